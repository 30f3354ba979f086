/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * From a model to the parameter image of the amplifier: the chain inverted, in fixed point.
 *
 * The image file holds the image's 32-bit words, least significant byte first.
 */
#ifndef COMPILE_H
#define COMPILE_H

#include "hyst/parameters.h"
#include "model.h"

typedef struct {
    double sample_rate_hz;       /**< 0: the model's */
    double drive_range_v[2];     /**< converter range; both 0: range of the fitted recordings, widened by 5 % */
    double position_range_um[2]; /**< likewise */
    bool no_filters;             /**< leave shape and equalise empty */
} compile_options_t;

/** What compiling gave up, in numbers. */
typedef struct {
    double lookahead_remainder_s; /**< delay that is not a whole number of samples */
    size_t merged_operators;      /**< play operators of the model that were merged into others */
    double merge_error_um; /**< largest difference of the branches that this makes, anywhere in the drive range */
} compile_report_t;

/** Compiles and validates. On failure one line says which block, or which field of the image, and why. report may be
 * NULL. */
bool compile_model(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                   compile_report_t *report, failure_t *failure);

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

#endif
