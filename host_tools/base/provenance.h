/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where a result comes from: what a lab book wants beside it, and what a file that is found in a year is worth.
 *
 * A program notes once what it was called with, which files it reads and which device it talks to; pages, recordings
 * and other outputs write that down. One note per process, as of progress. Nothing noted, as in a program that uses the
 * library: only date and version are known. Not for use beside a thread that writes results.
 */
#ifndef PROVENANCE_H
#define PROVENANCE_H

#include <stddef.h>

/** Notes the command line, quoted as a shell takes it. Forgets what was noted before. */
void provenance_begin(int argc, char *const *argv);
/** Notes a file that is read. What is no regular file when the result is written is left out. A file counts once. */
void provenance_add_file(const char *path);
/** Notes the device: name, serial, firmware, port. */
void provenance_set_device(const char *device);

typedef struct {
    char *path;
    char sha256[65]; /**< of its contents, hexadecimal */
} provenance_file_t;

typedef struct {
    char date[24];       /**< "2026-11-23 07:36:12 UTC"; of SOURCE_DATE_EPOCH where the environment has it */
    const char *command; /**< NULL: not noted */
    const char *device;  /**< NULL: none */
    size_t files;
    provenance_file_t *file;
} provenance_t;

/** What is known now. Reads the files, for their checksums. To be freed; valid until the next note. */
void provenance_now(provenance_t *provenance);
void provenance_free(provenance_t *provenance);

#endif
