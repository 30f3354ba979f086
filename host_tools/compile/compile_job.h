/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a block's `compile` hook works with (block.h): the parameter image under construction and the helpers that turn
 * a stage of the chain into its inverse in the amplifier.
 *
 * Hooks run in reverse order of the chain, except that the hysteresis comes last, after the blocks that modify it. By
 * then all other blocks are compiled. The hysteresis sees drives of drive_center_v +- drive_half_v over the whole range
 * of the amplifier. It must deliver elastic_center_um +- elastic_half_um for the range of the position converter.
 */
#ifndef COMPILE_JOB_H
#define COMPILE_JOB_H

#include "compile/compile_filters.h"
#include "compile/compile_report.h"
#include "elements/creep_cells.h"
#include "hyst/parameters.h"

typedef struct compile_job {
    const model_t *model;
    const compile_options_t *options;
    hyst_parameters_t *parameters;
    compile_report_t *report;
    failure_t *failure;
    const char *block; /**< name of the block that is being compiled, for messages */
    double rate_hz;
    double delay_s;                      /**< sum over the chain; becomes lookahead */
    double drive_center_v, drive_half_v; /**< drive of the hysteresis = center + half * Q31 fraction */
    double elastic_center_um, elastic_half_um;
    bool preload_taken, frequency_taken; /**< by a block, with the two functions below */
} compile_job_t;

/** A rising function of a signal, with its parameters in `state`. */
typedef double (*compile_function_t)(const void *state, double x);

/** A line for the user: how the block was inverted, and within which limits. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void compile_note(compile_job_t *job, const char *format, ...);

/** Reports why the block is not inverted, or only up to a limit. For reasons with numbers in them; otherwise use
 * block_t.uncorrected. */
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void compile_uncorrected(compile_job_t *job, const char *format, ...);

/** The options of these names. One that no block takes is refused in the end. */
double compile_preload_n(compile_job_t *job);
double compile_frequency_hz(compile_job_t *job);

/** value * 2^bits, rounded; a failure that names `what` outside 32 bits. */
bool compile_to_fixed(compile_job_t *job, double value, int bits, const char *what, int32_t *fixed);

/** Adds a section to the filter behind the hysteresis' inverse (equalise: undoes electronics) or before it (shape:
 * undoes mechanics and sensor), or only the delay of a filter that has no section. */
bool compile_equalise(compile_job_t *job, inverse_filter_t filter);
bool compile_shape(compile_job_t *job, inverse_filter_t filter);

/** Inverts a filter of second order with these parameters. put: compile_equalise or compile_shape. */
bool compile_second_order(compile_job_t *job, const parameter_t *parameter,
                          bool (*put)(compile_job_t *job, inverse_filter_t filter));

/** The amplifier's only bank of creep cells. */
bool compile_creep(compile_job_t *job, creep_cells_t cells);

/** The operators see this function of the drive, in V: puts it into the drive curve, and the image of the drive's range
 * into drive_center_v +- drive_half_v. A second drive curve is refused. */
bool compile_drive_curve(compile_job_t *job, compile_function_t function, const void *state);

/** The input of the sensor's curve must be this function of the reading, in um. Puts it into the reference curve, and
 * the image of the readings' range into elastic_center_um +- elastic_half_um. A second reference curve is refused. */
bool compile_reference_curve(compile_job_t *job, compile_function_t function, const void *state);

/** The hysteresis is this play bank, y = offset_um + weight[0] u + sum weight[i] play_i(u): reduced to the number of
 * operators of the amplifier, scaled and rounded. weight has operators + 1 elements. */
bool compile_play_bank(compile_job_t *job, double offset_um, size_t operators, const double *weight,
                       const double *threshold_v);

#endif
