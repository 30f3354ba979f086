/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a position that only depends on the path of the drive would read at each sample: what lags, changes of gain and
 * jumps are seen against.
 *
 * A drive that repeats itself often enough has its mean path (look/signal/repetition.h). Otherwise it is a
 * least-squares fit of columns that imitate a hysteresis of any shape and any past (look/path/reference_columns.h), and
 * of the slope of the same fit without a lag. Its coefficient is a lag of the position behind the drive.
 *
 * Any rate-independent hysteresis is near that. It is a ruler and no model: what it cannot follow is not called a
 * fault.
 */
#ifndef LOOK_REFERENCE_H
#define LOOK_REFERENCE_H

#include "look/signal/repetition.h"

typedef struct {
    bool repeated;    /**< the mean path */
    look_span_t span; /**< where it stands; all else is 0 */
    double *expected; /**< um, one a sample of the recording */
    double *slope;    /**< um a sample */
    double *error;    /**< position less expected */
    double left_um;   /**< root mean square of the error */
    /** Samples, of the fit; sigma HUGE_VAL where there is none. A lag is the same at every speed, level and time, in
     * either direction; what the fit cannot follow is not. So sigma is from how far whole parts of the motion (18:
     * direction, third of the speed, third of the range) and of the time (24) disagree about it, or from the noise
     * with its autocorrelation, whichever is larger. */
    double lag, lag_sigma;
    long shift;           /**< whole samples by which the drive was moved under the plays: lag has them in it */
    size_t plays_from;    /**< first sample that the fit has seen */
    double plays_left_um; /**< root mean square that the plays leave */
    /** Columns of the least squares, samples of the recording each, one after the other: those of the plays, and the
     * mean path and its slope where that is known. That of the lag is the slope of the plays' fit without one. */
    size_t column_count;
    double *columns;
} reference_t;

void reference_make(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                    reference_t *reference);
void reference_free(reference_t *reference);

/** As soon as they are needed no more: they are 100 times as large as the recording. */
void reference_columns_free(reference_t *reference);

#endif
