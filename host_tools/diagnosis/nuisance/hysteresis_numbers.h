/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What may change in a model's hysteresis while effects are looked for: the numbers of its block that are fitted. A
 * Preisach table, whose elements are many, changes smoothly (smooth_plane.h): there a number is how much of one smooth
 * function is added to all of it.
 */
#ifndef HYSTERESIS_NUMBERS_H
#define HYSTERESIS_NUMBERS_H

#include "chain/model.h"

typedef struct {
    parameter_t *parameter;
    size_t first, elements; /**< of the parameter, those that change with it */
    double *factor;         /**< by how much each of them; NULL: by as much as the number */
    double step;            /**< for a difference */
    double mean_size;       /**< of such numbers; 1 where all are 0 */
    double least;           /**< least change, 0 or below; -HUGE_VAL for none */
} hysteresis_number_t;

typedef struct {
    size_t count;
    hysteresis_number_t *number;
    model_block_t *block;
    double *kept; /**< all values of the block's parameters, as they were last kept */
} hysteresis_numbers_t;

/** The model must outlive them. */
void hysteresis_numbers_open(model_t *model, hysteresis_numbers_t *numbers);
void hysteresis_numbers_close(hysteresis_numbers_t *numbers);

/** How many there are. */
size_t hysteresis_numbers_count(const model_t *model);
/** So few that the position may well be far from linear in them: fits take more steps, which cost little. */
bool hysteresis_numbers_few(size_t count);
/** Whether it is: in those of Bouc-Wen, but not in the weights of a bank or a plane. What their derivatives say of an
 * effect beside them is then little more than a hint. */
bool hysteresis_far_from_linear(const model_t *model);

/** Whether it has so many that it imitates curves in or behind a hysteresis: a plane without symmetry. */
bool hysteresis_imitates_curves(const model_t *model);

/** The weight of a change's square in a sum of squares whose samples have that variance: a number is expected to change
 * by half of its mean size, so that what the samples say nothing about stays where it was. */
double hysteresis_number_stays(const hysteresis_number_t *number, double variance);

/** Changes the model. */
void hysteresis_number_add(const hysteresis_number_t *number, double change);
/** A copy of the model (to be freed) in which one of its numbers has changed. */
void hysteresis_number_changed(const hysteresis_numbers_t *numbers, size_t number, double change, const model_t *model,
                               model_t *changed);

/** Whether a parameter of the block is a Preisach table. */
bool hysteresis_is_table(const model_block_t *block, size_t parameter);

/** Notes the numbers as they are; and takes them back, to the last bit. */
void hysteresis_numbers_keep(const hysteresis_numbers_t *numbers);
void hysteresis_numbers_restore(const hysteresis_numbers_t *numbers);

/** Index of the model's hysteresis. */
size_t hysteresis_index(const model_t *model);

#endif
