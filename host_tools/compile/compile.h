/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Compiles a model into the parameter image of the amplifier: the inverse of the chain, in fixed point.
 *
 * Each block supplies its inverse in its `compile` hook (compile_job.h): an exact inverse for the hysteresis, an
 * inverse filter with a roll-off for a lag or a mode, lookahead for a delay. The roll-off leaves a delay at low
 * frequencies, which the lookahead compensates.
 *
 * Blocks that cannot be inverted (rails, drifts, hum) are omitted, and the report names each of them. Only a hysteresis
 * that the amplifier does not support is refused.
 *
 * The image file holds the image's 32-bit words, least significant byte first.
 */
#ifndef COMPILE_H
#define COMPILE_H

#include "compile/compile_report.h"
#include "hyst/parameters.h"

/** Compiles and validates. On failure one line says which block, or which field of the image, and why. report may be
 * NULL. */
bool compile_model(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                   compile_report_t *report, failure_t *failure);

/** What every image of this model has as its model_id: so an amplifier can tell which model it runs. The same for a
 * model that was written and read. */
uint32_t compile_model_id(const model_t *model);

/** Only the fields that follow from the ranges: the four scales, drive_low, drive_high and drive_park. For a twin with
 * the same converters. */
bool compile_scales(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                    failure_t *failure);

/** Validates as the amplifier does. `where` begins the message. */
bool parameters_check(const hyst_parameters_t *parameters, const char *where, failure_t *failure);

/** Most bytes of an image. */
#define IMAGE_MOST_BYTES (4 * HYST_IMAGE_MAX_WORDS)
/** The image as a file has it; `where` begins messages. */
bool image_to_bytes(const hyst_parameters_t *parameters, unsigned char bytes[IMAGE_MOST_BYTES], size_t *length,
                    const char *where, failure_t *failure);
/** The parameters of what a file has, validated. */
bool image_from_bytes(hyst_parameters_t *parameters, const unsigned char *bytes, size_t length, const char *where,
                      failure_t *failure);
bool image_write(const hyst_parameters_t *parameters, const char *path, failure_t *failure);
/** Reads and validates an image file. */
bool image_read(hyst_parameters_t *parameters, const char *path, failure_t *failure);

/** Between Q31 fractions of full scale and volts or micrometres, with the scales in the parameters. From a unit:
 * rounded, saturated. */
double drive_to_volts(const hyst_parameters_t *parameters, hyst_q31_t drive);
double position_to_micrometres(const hyst_parameters_t *parameters, hyst_q31_t position);
hyst_q31_t drive_from_volts(const hyst_parameters_t *parameters, double volts);
hyst_q31_t position_from_micrometres(const hyst_parameters_t *parameters, double micrometres);

/** The reference for a position, both as fractions of full scale. Without a reference curve it is the position. With
 * one it is limited to the range, as the reading of the sensor's converter is. */
double reference_for(const hyst_parameters_t *parameters, double position);

#endif
