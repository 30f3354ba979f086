/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The file of a recording that takes long to make: its room on the disk is taken before, and what cannot be written all
 * the same is written elsewhere.
 */
#ifndef RESERVED_OUTPUT_H
#define RESERVED_OUTPUT_H

#include "base/output_file.h"
#include "recording/recording.h"

typedef struct {
    const char *path;   /**< NULL: nothing is written */
    output_room_t room; /**< taken until it is written */
} reserved_output_t;

/** Takes room for a recording of so many rows. path, which may be NULL, must outlive it. After a failure nothing needs
 * to be closed. */
bool reserved_output_open(reserved_output_t *output, const char *path, size_t rows, failure_t *failure);

/** recording_write. Where that fails, so does this; but the recording is then in a new folder among those for temporary
 * files (TMPDIR, or /tmp), and the line says where. */
bool reserved_output_write(reserved_output_t *output, const recording_t *recording, failure_t *failure);

/** Gives the room back, if nothing was written. */
void reserved_output_close(reserved_output_t *output);

#endif
