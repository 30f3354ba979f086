/* SPDX-License-Identifier: GPL-3.0-or-later */
/** "-" as the name of a file: the standard streams, as names that every reader and writer of files takes. */
#ifndef STANDARD_STREAMS_H
#define STANDARD_STREAMS_H

#include "base/failure.h"

/**
 * A name for what stdout is now. From then on stdout is stderr, so that what a command tells does not get into what it
 * writes. Once per process; NULL: it was taken already, or cannot be.
 */
const char *standard_output_take(failure_t *failure);

/** A name for what stdin holds: all of it, kept in a temporary file, since some formats are not read from the beginning
 * to the end. The same name each time. NULL: it cannot be read. */
const char *standard_input_take(failure_t *failure);

#endif
