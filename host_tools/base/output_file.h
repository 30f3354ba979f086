/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Every file that a command writes: whole or not at all, and never over an input.
 *
 * A file is written beside its place, in the same folder under the name ".hyst-PROCESS-NUMBER.part", and renamed when
 * all of it is on the disk. A full disk or a kill leaves the previous file; a kill may also leave the .part. A symbolic
 * link stays one: the file that it names is replaced, with the permissions that it had. Another hard link to that file
 * keeps the old contents. Other than regular files (a pipe, a terminal, /dev/null), /dev/stdout, /dev/fd/N and /proc/..
 * are written in place.
 */
#ifndef OUTPUT_FILE_H
#define OUTPUT_FILE_H

#include "base/failure.h"
#include <stdio.h>

typedef struct {
    FILE *file; /**< to write to */
    char *name; /**< as the user gave it, for messages */
    char *path; /**< of the file that is replaced, links followed */
    char *part; /**< where it is written meanwhile; NULL: in place */
} output_file_t;

/**
 * Call it before long work or any motion. Checks that each output can be written, by creating and removing a file
 * beside it. Refuses an output that is an input (the same file, also through symbolic and hard links) or another
 * output. Skips NULL entries and inputs that do not exist. Writes nothing to a file that exists. Refuses a name such as
 * "run.mat" or "run.csv.gz", which promises a format that nothing here writes.
 */
bool output_files_check(const char *const *output, size_t outputs, const char *const *input, size_t inputs,
                        failure_t *failure);

/** On failure nothing needs to be closed. */
bool output_file_open(output_file_t *output, const char *path, failure_t *failure);

/** For a copy of a file of another program, whatever its name promises. */
bool output_file_open_copy(output_file_t *output, const char *path, failure_t *failure);

/**
 * Moves the file into place. If not `good`, or after a write error, the previous file stays and the result is false. If
 * not `good`, *failure is left as the caller set it.
 */
bool output_file_close(output_file_t *output, bool good, failure_t *failure);

/** Room on the disk that is taken for a file to be written later. */
typedef struct {
    char *part; /**< the file that takes it, beside its place; NULL: none */
} output_room_t;

/** Before long work: takes so many bytes in the folder of this output. What is written in place needs none. False: the
 * line has the reason alone, as "No space left on device". */
bool output_room_take(output_room_t *room, const char *path, size_t bytes, failure_t *failure);

/** Gives it back: the file can be written, or will not be. Again: nothing. */
void output_room_release(output_room_t *room);

/** Removes the .part of every file that is being written, for a process that ends now. Signal handlers may call it. */
void output_files_remove_parts(void);

#endif
