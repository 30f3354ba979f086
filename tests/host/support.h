/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the tests of the host tools share. */
#ifndef SUPPORT_H
#define SUPPORT_H

#include "chain/catalogue.h"
#include "chain/chain.h"
#include "random.h"

/** Writes a file of that name into the working directory. */
void write_file(const char *name, const char *content, size_t length);

/** TEST_FAIL unless the failure line is one line and contains the text. */
void expect_line(const failure_t *failure, const char *text);

/** A model with one Prandtl-Ishlinskii block. */
void make_bank_model(model_t *model, double sample_rate_hz, double offset_um, size_t operators, const double *weights,
                     const double *thresholds_v);

/** A bank finer than any that is fitted: thresholds up to 48 V, weights that fall by e in 12 V, 200 at most. */
void make_fine_bank_model(model_t *model, double sample_rate_hz, size_t operators);

/** A copy of a model with a block behind the last one of its place or an earlier one. value: one number a parameter. */
void insert_block(model_t *model, const model_t *shorter, const block_t *block, const double *value);

/** A modified play model of 10 divisions with a mode, +-75 V, phase 0.4 rad. */
void make_modified_play_model(model_t *model, double sample_rate_hz, double bilinear, double frequency_hz);

/** A chain of one block and a hysteresis that does nothing, at the block's place. values are in the order of the
 * block's table; those of lists are not read. */
chain_t *open_block(const block_t *block, const double *values, double rate_hz, uint64_t seed);
/** The block alone on values of which each one knows the next, as in a recording: replaces them. */
void pass_block(const block_t *block, const double *values, double rate_hz, size_t count, double *x);

/** Fills the displacement of a recording with the simulated chain. */
void simulate_into(recording_t *recording, const model_t *model, uint64_t seed);

/** The displacement of that chain with a block more (insert_block), and white noise. */
void measure_with(recording_t *recording, const model_t *shorter, const block_t *block, const double *value,
                  double noise_um, random_t *rng);

/** One step of Jiles and Atherton's law (1986) without negative slopes: the magnetisation where the field goes to h by
 * dh. Both are of the order of 1. */
double magnetised(double m, double h, double dh);

/** Fills values with straight lines through `count` corners, over and over, `per_line` samples a line. Corners are met
 * exactly. */
void fill_lines(double *values, size_t samples, const double *corner, size_t count, size_t per_line);

/** Fills a drive with forty frequencies that repeat nothing, from 0.5 Hz up to the highest, their amplitudes falling;
 * with three rests, from 2 to 98 V, where it is a few times. Their phases are random. */
void fill_tones(double *drive, size_t samples, double rate_hz, double highest_hz, random_t *rng);

#endif
