/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * From a model to the parameter image of the amplifier: the chain inverted, in fixed point.
 *
 * Each block says with its `compile` hook (compile_job.h) what undoes it: the hysteresis an exact inverse, a lag or a
 * mode an inverse filter with a roll-off, a delay the lookahead. What a roll-off leaves is a delay at low frequencies,
 * and the lookahead covers it. What cannot be undone (rails, drifts, hum) is left out of the inverse, and the report
 * names each such block: an image must not look as if it undid what it does not. Only a hysteresis that the amplifier
 * does not have is refused.
 *
 * The image file holds the image's 32-bit words, least significant byte first.
 */
#ifndef COMPILE_H
#define COMPILE_H

#include "hyst/parameters.h"
#include "model.h"

typedef struct {
    double sample_rate_hz; /**< 0: the model's */
    /** Converter range; both 0: as the recordings say that the model was fitted to, else what they cover, widened by
     * 5 %. */
    double drive_range_v[2];
    double position_range_um[2]; /**< likewise */
    /**
     * Delay beyond the model's and the converters' latency, as `hyst track` measures it. Negative when the position is
     * early: mechanics with a mode follow a held drive half a sample before the whole sample that the latency counts.
     */
    double delay_s;
    double frequency_hz; /**< of the sine that block ellipse is undone for; 0: its table's, if it has only one */
    double preload_n;    /**< force on the actuator, 0 or more: for a block preload without one of its own */
    /** What the reference means behind a sensor with a curve (static_nonlinearity): the reading, which is what the
     * model was fitted to and `hyst track` measures, so that the curve is undone; or the position, and the curve stays.
     */
    bool follow_position;
    bool no_filters; /**< leave shape and equalise empty; the lookahead then covers the delay of lags and modes */
} compile_options_t;

#define COMPILE_MAX_NOTES 16

/** A block of the model that the amplifier does not undo, or not beyond a limit. */
typedef struct {
    const char *block; /**< its name */
    char why[160];
} uncorrected_t;

/** What compiling gave up, in numbers. */
typedef struct {
    size_t model_operators; /**< of the model (Preisach: intervals); the image's are in the parameters */
    double merge_error_um;  /**< largest difference that merging (Preisach: other levels) makes to a branch */
    /** Delay that neither lookahead nor interpolation covers; without filters up to half a sample. */
    double lookahead_remainder_s;
    double growth_limit_v; /**< largest threshold growth the amplifier can represent; 0 without rate dependence */
    size_t notes;
    char note[COMPILE_MAX_NOTES][200]; /**< one line each: filters and their roll-off, how a block was undone */
    size_t uncorrected;
    uncorrected_t uncorrected_block[MODEL_MAX_BLOCKS]; /**< each block that the position still shows, or the reading */
} compile_report_t;

/** Compiles and validates. On failure one line says which block, or which field of the image, and why. report may be
 * NULL. */
bool compile_model(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                   compile_report_t *report, failure_t *failure);

/** Only what compile_model makes of the ranges: the four scale numbers, drive_low, drive_high and drive_park. For a
 * twin that shall stand behind the same converters. */
bool compile_scales(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                    failure_t *failure);

/** Validates as the amplifier does. `where` begins the message. */
bool parameters_check(const hyst_parameters_t *parameters, const char *where, failure_t *failure);

bool image_write(const hyst_parameters_t *parameters, const char *path, failure_t *failure);
/** Reads and validates an image file. */
bool image_read(hyst_parameters_t *parameters, const char *path, failure_t *failure);

/** Between Q31 fractions of full scale and volts or micrometres, with the scales in the parameters. From a unit:
 * rounded, saturated. */
double drive_to_volts(const hyst_parameters_t *parameters, hyst_q31_t drive);
double position_to_micrometres(const hyst_parameters_t *parameters, hyst_q31_t position);
hyst_q31_t drive_from_volts(const hyst_parameters_t *parameters, double volts);
hyst_q31_t position_from_micrometres(const hyst_parameters_t *parameters, double micrometres);

/** The reference that asks for a position, both in fractions of full scale: the position itself without a reference
 * curve. With one it stays within the range, as what the sensor's converter reads does. */
double reference_for(const hyst_parameters_t *parameters, double position);

#endif
