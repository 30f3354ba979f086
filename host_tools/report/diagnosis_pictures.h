/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Before and after, in pictures. */
#ifndef DIAGNOSIS_PICTURES_H
#define DIAGNOSIS_PICTURES_H

#include "diagnosis/noise/noise.h"
#include <stdio.h>

/** A recording and two models of it, or one: before_um is then NULL. */
typedef struct {
    const double *drive_v, *measured_um, *before_um, *after_um; /**< samples that count */
    size_t samples;
    double sample_rate_hz, start_s; /**< time of the first of them */
    const noise_t *noise;           /**< NULL: not known */
} compared_t;

/** As six figures: loop and error over the drive, a stretch of time and the error there, residual and its spectrum. */
void write_pictures(FILE *file, const compared_t *compared);

#endif
