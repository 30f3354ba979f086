/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/model.h"
#include "chain/catalogue.h"
#include <assert.h>
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void model_create(model_t *model, double sample_rate_hz) {
    memset(model, 0, sizeof *model);
    model->sample_rate_hz = sample_rate_hz;
}

static void block_free(model_block_t *block) {
    for (size_t p = 0; p < block->block->parameters; p++) {
        free(block->parameter[p].value);
        free(block->parameter[p].sigma);
    }
}

void model_free(model_t *model) {
    for (size_t i = 0; i < model->blocks; i++) {
        block_free(&model->block[i]);
    }
    json_decref(model->fit);
    memset(model, 0, sizeof *model);
}

static void parameter_set(parameter_t *parameter, size_t count, const double *value, const double *sigma) {
    double *const copy = allocate(count, sizeof(double));
    double *const sigma_copy = sigma != NULL ? allocate(count, sizeof(double)) : NULL;
    if (count > 0) {
        memcpy(copy, value, count * sizeof(double));
    }
    if (sigma != NULL && count > 0) {
        memcpy(sigma_copy, sigma, count * sizeof(double));
    }
    free(parameter->value);
    free(parameter->sigma);
    *parameter = (parameter_t){.count = count, .value = copy, .sigma = sigma_copy};
}

void model_remove(model_t *model, size_t index) {
    block_free(&model->block[index]);
    memmove(&model->block[index], &model->block[index + 1], (--model->blocks - index) * sizeof model->block[0]);
}

void model_without_noise(model_t *model) {
    for (size_t b = model->blocks; b-- > 0;) {
        if (model->block[b].block->readings != READINGS_AS_THEY_ARE) {
            model_remove(model, b);
        }
    }
}

model_block_t *model_append(model_t *model, const block_t *block) {
    model_block_t *const appended = &model->block[model->blocks++];
    assert(model->blocks <= MODEL_MAX_BLOCKS && block->parameters <= BLOCK_MAX_PARAMETERS);
    *appended = (model_block_t){.block = block}; /* what stood there may be a block that was removed or moved */
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_info_t *info = &block->parameter[p];
        const double value = info->optional ? info->default_value : 0.0;
        parameter_set(&appended->parameter[p], info->array ? 0 : 1, &value, NULL);
    }
    return appended;
}

/* Index in the block's table; the name is a constant in the source. */
static size_t parameter_index(const block_t *block, const char *name) {
    size_t p = 0;
    while (p < block->parameters && strcmp(block->parameter[p].name, name) != 0) {
        p++;
    }
    assert(p < block->parameters);
    return p;
}

void model_set_array(model_block_t *block, const char *name, size_t count, const double *value, const double *sigma) {
    parameter_set(&block->parameter[parameter_index(block->block, name)], count, value, sigma);
}

void model_set(model_block_t *block, const char *name, double value) {
    model_set_array(block, name, 1, &value, NULL);
}

static void copy_block(model_t *copy, const model_block_t *from) {
    model_block_t *block = model_append(copy, from->block);
    for (size_t p = 0; p < block->block->parameters; p++) {
        parameter_set(&block->parameter[p], from->parameter[p].count, from->parameter[p].value,
                      from->parameter[p].sigma);
    }
}

void model_copy(model_t *copy, const model_t *model) {
    model_create(copy, model->sample_rate_hz);
    for (size_t i = 0; i < model->blocks; i++) {
        copy_block(copy, &model->block[i]);
    }
    copy->fit = model->fit != NULL ? json_deep_copy(model->fit) : NULL;
}

static bool same_numbers(const model_block_t *one, const model_block_t *other) {
    for (size_t p = 0; p < one->block->parameters; p++) {
        const parameter_t *a = &one->parameter[p], *b = &other->parameter[p];
        if (a->count != b->count || (a->count > 0 && memcmp(a->value, b->value, a->count * sizeof(double)) != 0)) {
            return false;
        }
    }
    return true;
}

bool model_same_blocks(const model_t *one, const model_t *other) {
    bool same = one->blocks == other->blocks && one->sample_rate_hz == other->sample_rate_hz;
    for (size_t i = 0; same && i < one->blocks; i++) {
        const model_block_t *twin = model_find(other, one->block[i].block->name);
        same = twin != NULL && same_numbers(&one->block[i], twin);
    }
    return same;
}

void model_copy_place(model_t *copy, const model_t *model, place_t place) {
    model_create(copy, model->sample_rate_hz);
    for (size_t i = 0; i < model->blocks; i++) {
        if (model->block[i].block->place == place) {
            copy_block(copy, &model->block[i]);
        }
    }
}

const model_block_t *model_find(const model_t *model, const char *block_name) {
    for (size_t i = 0; i < model->blocks; i++) {
        if (strcmp(model->block[i].block->name, block_name) == 0) {
            return &model->block[i];
        }
    }
    return NULL;
}

void model_remove_block(model_t *model, const block_t *block) {
    model_remove(model, (size_t)(model_find(model, block->name) - model->block));
}

double model_lag_s(const model_block_t *block) {
    const double number = block->parameter[0].value[0];
    switch (block->block->lag) {
    case LAG_DELAY:
        return number;
    case LAG_LOW_PASS:
        return 1.0 / (2.0 * M_PI * number);
    case LAG_NONE:
        break;
    }
    return HUGE_VAL;
}

const parameter_t *model_parameter(const model_block_t *block, const char *name) {
    return &block->parameter[parameter_index(block->block, name)];
}

static bool check_count(const parameter_info_t *info, size_t count, failure_t *failure) {
    if (!info->array) {
        return count == 1 || fail(failure, "%s has %zu elements", info->name, count);
    }
    const size_t most = info->most > 0 ? info->most : PARAMETER_MAX_ELEMENTS;
    return count <= most || fail(failure, "%s has %zu elements, at most %zu are allowed", info->name, count, most);
}

static bool check_block(const model_block_t *block, const char *where, failure_t *failure) {
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_info_t *info = &block->block->parameter[p];
        const parameter_t *parameter = &block->parameter[p];
        if (!check_count(info, parameter->count, failure)) {
            return fail_in(failure, "%s: block %s", where, block->block->name);
        }
        for (size_t e = 0; e < parameter->count; e++) {
            const double value = parameter->value[e];
            const bool absent = info->optional && !info->array && value == info->default_value;
            if (!absent && !(isfinite(value) && value >= info->low && value <= info->high)) {
                char element[24] = "";
                if (info->array) {
                    snprintf(element, sizeof element, "[%zu]", e);
                }
                const bool pure = strcmp(info->unit, "1") == 0;
                return fail(failure, "%s: block %s: %s%s = %g%s%s is outside [%g, %g]", where, block->block->name,
                            info->name, element, value, pure ? "" : " ", pure ? "" : info->unit, info->low, info->high);
            }
            if (info->rising && e > 0 && !(value > parameter->value[e - 1])) {
                return fail(failure, "%s: block %s: %s[%zu] does not rise", where, block->block->name, info->name, e);
            }
        }
    }
    if (block->block->check != NULL && !block->block->check(block->parameter, failure)) {
        return fail_in(failure, "%s: block %s", where, block->block->name);
    }
    return true;
}

bool model_check(const model_t *model, const char *where, failure_t *failure) {
    size_t hystereses = 0;
    const block_t *hysteresis = NULL, *widening = NULL;
    place_t place = PLACE_ELECTRONICS;
    if (!(isfinite(model->sample_rate_hz) && model->sample_rate_hz > 0.0)) {
        return fail(failure, "%s: sample_rate_hz = %g is not a positive number", where, model->sample_rate_hz);
    }
    for (size_t i = 0; i < model->blocks; i++) {
        const block_t *block = model->block[i].block;
        if (!check_block(&model->block[i], where, failure)) {
            return false;
        }
        if (block->place < place) {
            return fail(failure, "%s: block %s (%s) stands behind a block of %s", where, block->name,
                        place_name(block->place), place_name(place));
        }
        place = block->place;
        if (block_is_hysteresis(block)) {
            hystereses++;
            hysteresis = block;
        }
        widening = block->widens ? block : widening;
        if (block->follows_hysteresis && hystereses == 0) {
            return fail(failure, "%s: block %s stands before the hysteresis that it follows", where, block->name);
        }
    }
    if (hystereses != 1) {
        return fail(failure, "%s: a chain needs exactly one hysteresis block, this one has %zu", where, hystereses);
    }
    if (widening != NULL && !hysteresis->can_widen) {
        return fail(failure, "%s: block %s widens plays or relays, and %s has none", where, widening->name,
                    hysteresis->name);
    }
    return true;
}

bool model_fit_range(const model_t *model, const char *key, double range[2]) {
    const json_t *pair = json_object_get(model->fit, key);
    if (json_array_size(pair) != 2 || !json_is_number(json_array_get(pair, 0)) ||
        !json_is_number(json_array_get(pair, 1))) {
        return false;
    }
    range[0] = json_number_value(json_array_get(pair, 0));
    range[1] = json_number_value(json_array_get(pair, 1));
    return range[0] < range[1];
}
