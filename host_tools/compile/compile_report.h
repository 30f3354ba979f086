/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Options of compile.h, and its report. */
#ifndef COMPILE_REPORT_H
#define COMPILE_REPORT_H

#include "chain/model.h"

typedef struct {
    double sample_rate_hz; /**< 0: the model's */
    /** Converter range; both 0: that of the fit's recordings if they state it, else the range they cover, widened by 5
     * %. */
    double drive_range_v[2];
    double position_range_um[2]; /**< likewise */
    /**
     * Delay beyond the model's and the converters' latency, as `hyst track` measures it. Negative when the position is
     * early: mechanics with a mode follow a held drive half a sample before the whole sample that the latency counts.
     */
    double delay_s;
    /** Of the sine for which block ellipse is inverted; 0: that of its table, if it has only one. Refused without that
     * block. */
    double frequency_hz;
    /** Force on the actuator, 0 or more: for a block preload without a force parameter. Above 0 refused without that
     * block. */
    double preload_n;
    /** Meaning of the reference for a sensor with a curve (static_nonlinearity). false: the reading, to which the model
     * was fitted and which `hyst track` measures, so the curve is inverted. true: the position, and the curve is not
     * inverted. */
    bool follow_position;
    bool no_filters; /**< leave shape and equalise empty; the lookahead then covers the delay of lags and modes */
} compile_options_t;

#define COMPILE_MAX_NOTES 16

/** A block of the model that the amplifier does not undo, or not beyond a limit. */
typedef struct {
    const char *block; /**< its name */
    char why[160];
} uncorrected_t;

/** Approximation errors of the compiled image. */
typedef struct {
    size_t model_operators; /**< of the model (Preisach: intervals); the image's are in the parameters */
    double merge_error_um;  /**< largest change of a branch by merging (Preisach: by other levels) */
    /** Delay that neither lookahead nor interpolation covers; without filters up to half a sample. */
    double lookahead_remainder_s;
    double growth_limit_v; /**< largest threshold growth the amplifier can represent; 0 without rate dependence */
    size_t notes;
    char note[COMPILE_MAX_NOTES][200]; /**< one line each: filters and their roll-off, how a block was undone */
    size_t uncorrected;
    uncorrected_t
        uncorrected_block[MODEL_MAX_BLOCKS]; /**< each block whose effect remains in the position or in the reading */
} compile_report_t;

#endif
