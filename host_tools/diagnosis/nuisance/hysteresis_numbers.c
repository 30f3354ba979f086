/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/nuisance/smooth_bank.h"
#include "diagnosis/nuisance/smooth_plane.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

size_t hysteresis_index(const model_t *model) {
    size_t i = 0;
    while (!block_is_hysteresis(model->block[i].block)) {
        i++;
    }
    return i;
}

bool hysteresis_is_table(const model_block_t *block, size_t p) {
    return block->block->operators == OPERATORS_RELAYS && strcmp(block->block->parameter[p].name, "everett_um") == 0;
}

/* Functions are given the size of the whole table, so that numbers are about 1. */
static size_t list_smooth_plane(const model_block_t *block, parameter_t *table, hysteresis_number_t *number) {
    const parameter_t *levels = model_parameter(block, "levels_v");
    const preisach_grid_t grid = {.levels = levels->count, .level_v = levels->value};
    const double whole_um = fabs(table->value[preisach_element(grid.levels - 1, 0)]);
    const double scale_um = whole_um > 0.0 ? whole_um : 1.0;
    const bool symmetric = smooth_plane_is_symmetric(grid.levels, table->value);
    double *value = allocate(table->count, sizeof(double));
    size_t count = 0;
    for (size_t f = 0; f < smooth_plane_functions(); f++) {
        if (smooth_plane_function(&grid, symmetric, f, value) > 0.0) {
            if (number != NULL) {
                number[count] = (hysteresis_number_t){.parameter = table,
                                                      .elements = table->count,
                                                      .factor = allocate(table->count, sizeof(double)),
                                                      .step = threshold.derivative_step,
                                                      .mean_size = 1.0,
                                                      .least = -HUGE_VAL};
                for (size_t e = 0; e < table->count; e++) {
                    number[count].factor[e] = scale_um * value[e];
                }
            }
            count++;
        }
    }
    free(value);
    return count;
}

static bool is_fine_bank(const model_block_t *block, size_t p) {
    return block->block->operators == OPERATORS_PLAYS && strcmp(block->block->parameter[p].name, "weights") == 0 &&
           block->parameter[p].count > 1 + SMOOTH_BANK_OPERATORS;
}

/* w_0, and functions of the size of all weights together. */
static size_t list_smooth_bank(const model_block_t *block, parameter_t *weights, hysteresis_number_t *number) {
    const parameter_t *thresholds = model_parameter(block, "thresholds_v");
    double sum = 0.0;
    for (size_t e = 0; e < weights->count; e++) {
        sum += fabs(weights->value[e]);
    }
    const double size = sum > 0.0 ? sum : 1.0;
    if (number != NULL) {
        number[0] = (hysteresis_number_t){.parameter = weights,
                                          .elements = 1,
                                          .step = threshold.derivative_step * size,
                                          .mean_size = size,
                                          .least = -HUGE_VAL};
        for (size_t f = 0; f < SMOOTH_BANK_FUNCTIONS; f++) {
            number[1 + f] = (hysteresis_number_t){.parameter = weights,
                                                  .first = 1,
                                                  .elements = thresholds->count,
                                                  .factor = allocate(thresholds->count, sizeof(double)),
                                                  .step = threshold.derivative_step,
                                                  .mean_size = 1.0,
                                                  .least = -HUGE_VAL};
            smooth_bank_function(thresholds->value, thresholds->count, f, number[1 + f].factor);
            for (size_t e = 0; e < thresholds->count; e++) {
                number[1 + f].factor[e] *= size;
            }
        }
    }
    return 1 + SMOOTH_BANK_FUNCTIONS;
}

static size_t list_elements(const parameter_info_t *info, parameter_t *parameter, hysteresis_number_t *number) {
    double mean = 0.0, least = HUGE_VAL;
    for (size_t e = 0; e < parameter->count; e++) {
        mean += fabs(parameter->value[e]) / (double)parameter->count;
        least = fmin(least, parameter->value[e]);
    }
    const double low = info->array && strcmp(info->name, "weights") == 0 && least >= 0.0 ? 0.0 : info->low;
    const double size = mean > 0.0 ? mean : 1.0;
    for (size_t e = 0; number != NULL && e < parameter->count; e++) {
        number[e] = (hysteresis_number_t){.parameter = parameter,
                                          .first = e,
                                          .elements = 1,
                                          .step = threshold.derivative_step * size,
                                          .mean_size = size,
                                          .least = fmin(0.0, low - parameter->value[e])};
    }
    return parameter->count;
}

/* A term that a shape may have and this one has not: it would be an effect (interleaved_hysteresis) under another name.
 */
static bool is_absent(const parameter_info_t *info, const parameter_t *parameter) {
    return info->optional && !info->array && info->default_value == 0.0 && parameter->value[0] == 0.0;
}

/* number may be NULL. */
static size_t list(model_block_t *block, hysteresis_number_t *number) {
    size_t count = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        hysteresis_number_t *next = number == NULL ? NULL : number + count;
        if (hysteresis_is_table(block, p)) {
            count += list_smooth_plane(block, &block->parameter[p], next);
        } else if (is_fine_bank(block, p)) {
            count += list_smooth_bank(block, &block->parameter[p], next);
        } else if (!block->block->parameter[p].chosen &&
                   !is_absent(&block->block->parameter[p], &block->parameter[p])) {
            count += list_elements(&block->block->parameter[p], &block->parameter[p], next);
        }
    }
    return count;
}

size_t hysteresis_numbers_count(const model_t *model) {
    model_block_t block = model->block[hysteresis_index(model)]; /* a view: nothing changes */
    return list(&block, NULL);
}

bool hysteresis_numbers_few(size_t count) {
    return count < 12;
}

bool hysteresis_far_from_linear(const model_t *model) {
    const block_t *block = model->block[hysteresis_index(model)].block;
    return block->operators == OPERATORS_OTHER && hysteresis_numbers_few(hysteresis_numbers_count(model));
}

bool hysteresis_imitates_curves(const model_t *model) {
    const model_block_t *block = &model->block[hysteresis_index(model)];
    return block->block->operators == OPERATORS_RELAYS &&
           !smooth_plane_is_symmetric(model_parameter(block, "levels_v")->count,
                                      model_parameter(block, "everett_um")->value);
}

void hysteresis_numbers_open(model_t *model, hysteresis_numbers_t *numbers) {
    model_block_t *block = &model->block[hysteresis_index(model)];
    size_t values = 0;
    for (size_t p = 0; p < block->block->parameters; p++) {
        values += block->parameter[p].count;
    }
    const size_t most = values + smooth_plane_functions(); /* a small table has fewer elements than functions */
    *numbers = (hysteresis_numbers_t){
        .number = allocate(most, sizeof *numbers->number), .block = block, .kept = allocate(values, sizeof(double))};
    numbers->count = list(block, numbers->number);
    hysteresis_numbers_keep(numbers);
}

void hysteresis_numbers_close(hysteresis_numbers_t *numbers) {
    for (size_t i = 0; i < numbers->count; i++) {
        free(numbers->number[i].factor);
    }
    free(numbers->number);
    free(numbers->kept);
    *numbers = (hysteresis_numbers_t){0};
}

void hysteresis_numbers_keep(const hysteresis_numbers_t *numbers) {
    double *kept = numbers->kept;
    for (size_t p = 0; p < numbers->block->block->parameters; p++) {
        for (size_t e = 0; e < numbers->block->parameter[p].count; e++) {
            *kept++ = numbers->block->parameter[p].value[e];
        }
    }
}

void hysteresis_numbers_restore(const hysteresis_numbers_t *numbers) {
    const double *kept = numbers->kept;
    for (size_t p = 0; p < numbers->block->block->parameters; p++) {
        for (size_t e = 0; e < numbers->block->parameter[p].count; e++) {
            numbers->block->parameter[p].value[e] = *kept++;
        }
    }
}

static void add(const hysteresis_number_t *number, double change, parameter_t *parameter) {
    double *value = parameter->value + number->first;
    for (size_t e = 0; e < number->elements; e++) {
        value[e] += change * (number->factor != NULL ? number->factor[e] : 1.0);
    }
}

double hysteresis_number_stays(const hysteresis_number_t *number, double variance) {
    return variance / gsl_pow_2(threshold.expected_change * number->mean_size);
}

void hysteresis_number_add(const hysteresis_number_t *number, double change) {
    add(number, change, number->parameter);
}

void hysteresis_number_changed(const hysteresis_numbers_t *numbers, size_t number, double change, const model_t *model,
                               model_t *changed) {
    const hysteresis_number_t *of = &numbers->number[number];
    model_copy(changed, model);
    add(of, change, &changed->block[hysteresis_index(changed)].parameter[of->parameter - numbers->block->parameter]);
}
