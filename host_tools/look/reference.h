/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a position that only depends on the path of the drive would read at each sample: what lags, changes of gain and
 * jumps are seen against.
 *
 * A drive that repeats itself often enough has its mean path (look/repetition.h). Otherwise it is a
 * least-squares fit of these columns:
 *
 * - a constant, and the drive to the third power;
 * - 24 plays with thresholds over half of the range, on the drive interpolated four times as finely by a cubic (unless
 *   the drive is held);
 * - a straight line in time, and the logarithm of time;
 * - the curvature of the drive, and the slope of the same without a lag. Its coefficient is a lag of the position
 * behind the drive.
 *
 * Any rate-independent hysteresis is near that. It is a ruler and no model: what it cannot follow is not called a
 * fault.
 */
#ifndef LOOK_REFERENCE_H
#define LOOK_REFERENCE_H

#include "look/repetition.h"

typedef struct {
    bool repeated;    /**< the mean path */
    look_span_t span; /**< where it stands; all else is 0 */
    double *expected; /**< um, one a sample of the recording */
    double *slope;    /**< um a sample */
    double *error;    /**< position less expected */
    double left_um;   /**< root mean square of the error */
    /** Samples, of the plays; sigma HUGE_VAL where there are none. It holds what an error of the reference could do
     * that is as large as what the reference leaves beside the noise, all of it in the direction of a lag. */
    double lag, lag_sigma;
    long shift;           /**< whole samples by which the drive was moved under the plays: lag has them in it */
    size_t plays_from;    /**< first sample whose past the plays know */
    double *lag_column;   /**< slope of the plays' fit without a lag, one a sample */
    double plays_left_um; /**< root mean square that the plays leave */
} reference_t;

/** noise_um: of the readings, as far as it is known. */
void reference_make(const recording_t *recording, const drive_look_t *drive, const repetition_t *repetition,
                    double noise_um, reference_t *reference);
void reference_free(reference_t *reference);

/** The columns of the least squares, samples of the recording each, one after the other; two more where the mean path
 * is known: that and its slope. */
size_t reference_columns_count(const reference_t *reference);
void reference_columns(const recording_t *recording, const drive_look_t *drive, const reference_t *reference,
                       double *columns);

#endif
