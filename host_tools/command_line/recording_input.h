/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef RECORDING_INPUT_H
#define RECORDING_INPUT_H

#include "recording/recording.h"
#include <math.h>

/** Part of each recording. Begin with SPAN_WHOLE. */
typedef struct {
    double from_s, to_s;
} span_t;
#define SPAN_WHOLE ((span_t){-(double)INFINITY, (double)INFINITY})
#define SPAN_OPTIONS(span)                                                                                             \
    {"--from", NULL, OPTION_NUMBER, "S", "drop what was recorded before this time", &(span).from_s}, {                 \
        "--to", NULL, OPTION_NUMBER, "S", "drop what was recorded from this time on", &(span).to_s                     \
    }

/** recording_read, with drive and position at the same instants (chain/align.h); and for a file of another format its
 * interpretation on stderr, before any use of it. */
bool read_recording_aloud(recording_t *recording, const char *path, failure_t *failure);

/** The same for several, in their order; to be released by recordings_free. NULL: some could not be read. *failure is
 * then about the last of these, and the lines about the others are on stderr: all are known after one run. */
recording_t *read_recordings_aloud(char *const *paths, size_t count, failure_t *failure);
/** And only that part of each. */
recording_t *read_spans_aloud(char *const *paths, size_t count, const span_t *span, failure_t *failure);
void recordings_free(recording_t *recordings, size_t count);

#endif
