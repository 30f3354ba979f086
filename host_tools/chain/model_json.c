/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The JSON form of a model. Reading is strict, and every message names the block and parameter. */
#include "base/json_input.h"
#include "base/json_output.h"
#include "chain/catalogue.h"
#include "chain/model.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FORMAT "hyst-model-1"

/* Array of count numbers from JSON; a scalar counts as one element, and null as null_value, if that is a number. NULL
 * after a complaint; free the result. */
static double *numbers_from_json(const json_t *json, bool array, double null_value, size_t *count, const char *what,
                                 failure_t *failure) {
    double *numbers;
    const bool null_allowed = !isnan(null_value);
    if (array ? !json_is_array(json) : !json_is_number(json) && !(null_allowed && json_is_null(json))) {
        fail(failure, "%s must be %s", what, array ? "an array of numbers" : "a number");
        return NULL;
    }
    *count = array ? json_array_size(json) : 1;
    if (*count > PARAMETER_MAX_ELEMENTS) {
        fail(failure, "%s has %zu elements, at most %d are allowed", what, *count, PARAMETER_MAX_ELEMENTS);
        return NULL;
    }
    numbers = allocate(*count, sizeof(double));
    for (size_t i = 0; i < *count; i++) {
        const json_t *element = array ? json_array_get(json, i) : json;
        if (!json_is_number(element) && !(null_allowed && json_is_null(element))) {
            fail(failure, "%s[%zu] is not a number", what, i);
            free(numbers);
            return NULL;
        }
        numbers[i] = json_is_null(element) ? null_value : json_number_value(element);
    }
    return numbers;
}

static bool sigma_from_json(const json_t *json, bool array, parameter_t *parameter, failure_t *failure) {
    size_t count = 0;
    parameter->sigma = numbers_from_json(json, array, HUGE_VAL, &count, "sigma", failure);
    if (parameter->sigma == NULL) {
        return false;
    }
    if (count != parameter->count) {
        return fail(failure, "sigma has %zu elements, value has %zu", count, parameter->count);
    }
    for (size_t i = 0; i < count; i++) {
        if (!(parameter->sigma[i] >= 0.0)) {
            return fail(failure, "sigma = %g is negative", parameter->sigma[i]);
        }
    }
    return true;
}

/* {"value":, "sigma":, "unit":} or the bare value. */
static bool parameter_from_json(const json_t *json, const parameter_info_t *info, parameter_t *parameter,
                                failure_t *failure) {
    const json_t *value = json, *sigma = NULL;
    if (json_is_object(json)) {
        const char *key;
        json_t *member;
        json_object_foreach((json_t *)json, key, member) {
            if (strcmp(key, "unit") == 0) {
                if (!json_is_string(member) || strcmp(json_string_value(member), info->unit) != 0) {
                    return fail(failure, "unit must be \"%s\"", info->unit);
                }
            } else if (strcmp(key, "determined") == 0) { /* for human readers; sigma has the same information */
                if (!json_is_boolean(member) && !json_is_array(member)) {
                    return fail(failure, "determined must be true, false or an array of these");
                }
            } else if (strcmp(key, "value") != 0 && strcmp(key, "sigma") != 0) {
                return fail(failure, "unknown key \"%s\"", key);
            }
        }
        value = json_object_get(json, "value");
        sigma = json_object_get(json, "sigma");
        if (value == NULL) {
            return fail(failure, "no \"value\"");
        }
    }
    free(parameter->value);
    parameter->value = numbers_from_json(value, info->array, (double)NAN, &parameter->count, "value", failure);
    return parameter->value != NULL && (sigma == NULL || sigma_from_json(sigma, info->array, parameter, failure));
}

/* What stands for an absent parameter. */
static bool parameter_from_fit(const model_t *model, const parameter_info_t *info, parameter_t *parameter,
                               failure_t *failure) {
    const char *key = info->center_of != NULL ? info->center_of : info->half_of;
    double range[2];
    if (info->optional) {
        return true;
    }
    if (key == NULL) {
        return fail(failure, "missing parameter \"%s\"", info->name);
    }
    if (!model_fit_range(model, key, range)) {
        return fail(failure, "missing parameter \"%s\", and the model's \"fit\" has no \"%s\" to take it from",
                    info->name, key);
    }
    parameter->value[0] = key == info->center_of ? 0.5 * (range[0] + range[1]) : 0.5 * (range[1] - range[0]);
    return true;
}

static bool block_from_json(model_t *model, const json_t *json, failure_t *failure) {
    const json_t *name = json_object_get(json, "block"), *parameters = json_object_get(json, "parameters");
    const block_t *block;
    model_block_t *appended;
    const char *key;
    json_t *member;
    if (!json_is_string(name)) {
        return fail(failure, "needs a string \"block\"");
    }
    block = catalogue_find(json_string_value(name));
    if (block == NULL) {
        return fail(failure, "unknown block \"%s\"", json_string_value(name));
    }
    if (!json_is_object(parameters)) {
        return fail(failure, "block %s: needs an object \"parameters\"", block->name);
    }
    json_object_foreach((json_t *)json, key, member) {
        if (strcmp(key, "block") != 0 && strcmp(key, "parameters") != 0) {
            return fail(failure, "block %s: unknown key \"%s\"", block->name, key);
        }
    }
    appended = model_append(model, block);
    for (size_t p = 0; p < block->parameters; p++) {
        const json_t *parameter = json_object_get(parameters, block->parameter[p].name);
        if (parameter == NULL && !parameter_from_fit(model, &block->parameter[p], &appended->parameter[p], failure)) {
            return fail_in(failure, "block %s", block->name);
        }
        if (parameter != NULL &&
            !parameter_from_json(parameter, &block->parameter[p], &appended->parameter[p], failure)) {
            return fail_in(failure, "block %s: parameter %s", block->name, block->parameter[p].name);
        }
    }
    json_object_foreach((json_t *)parameters, key, member) {
        size_t p = 0;
        while (p < block->parameters && strcmp(block->parameter[p].name, key) != 0) {
            p++;
        }
        if (p == block->parameters) {
            return fail(failure, "block %s: unknown parameter \"%s\"", block->name, key);
        }
    }
    return true;
}

static bool fill_from_json(model_t *model, const json_t *json, failure_t *failure) {
    const json_t *format = json_object_get(json, "format"), *rate = json_object_get(json, "sample_rate_hz");
    const json_t *chain = json_object_get(json, "chain"), *fit = json_object_get(json, "fit");
    const char *key;
    json_t *member;
    if (!json_is_string(format) || strcmp(json_string_value(format), FORMAT) != 0) {
        return fail(failure, "not a model: \"format\" must be \"" FORMAT "\"");
    }
    if (!json_is_number(rate)) {
        return fail(failure, "\"sample_rate_hz\" must be a number");
    }
    if (!json_is_array(chain)) {
        return fail(failure, "\"chain\" must be an array of blocks");
    }
    if (fit != NULL && !json_is_object(fit)) {
        return fail(failure, "\"fit\" must be an object");
    }
    json_object_foreach((json_t *)json, key, member) {
        static const char *const known[] = {"format", "sample_rate_hz", "chain", "fit"};
        size_t i = 0;
        while (i < sizeof known / sizeof known[0] && strcmp(known[i], key) != 0) {
            i++;
        }
        if (i == sizeof known / sizeof known[0]) {
            return fail(failure, "unknown key \"%s\"", key);
        }
    }
    if (json_array_size(chain) > MODEL_MAX_BLOCKS) {
        return fail(failure, "chain has %zu blocks, at most %d are allowed", json_array_size(chain), MODEL_MAX_BLOCKS);
    }
    model->sample_rate_hz = json_number_value(rate);
    model->fit = fit != NULL ? json_deep_copy(fit) : NULL;
    for (size_t i = 0; i < json_array_size(chain); i++) {
        if (!block_from_json(model, json_array_get(chain, i), failure)) {
            return fail_in(failure, "chain[%zu]", i);
        }
    }
    return true;
}

bool model_from_json(model_t *model, const json_t *json, const char *where, failure_t *failure) {
    model_create(model, 0.0);
    if (!fill_from_json(model, json, failure)) {
        fail_in(failure, "%s", where);
    } else if (model_check(model, where, failure)) {
        return true;
    }
    model_free(model);
    return false;
}

bool model_read(model_t *model, const char *path, failure_t *failure) {
    json_t *json = json_read(path, "a model", failure);
    if (json == NULL) {
        memset(model, 0, sizeof *model);
        return false;
    }
    const bool good = model_from_json(model, json, path, failure);
    json_decref(json);
    return good;
}

/* What is not finite becomes null. */
static json_t *numbers_to_json(const double *numbers, size_t count, bool array) {
    json_t *json;
    if (!array) {
        return json_number_or_null(numbers[0]);
    }
    json = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(json, json_number_or_null(numbers[i]));
    }
    return json;
}

/* Where sigma is null. */
static json_t *determined_to_json(const double *sigma, size_t count, bool array) {
    json_t *json;
    if (!array) {
        return json_boolean(isfinite(sigma[0]));
    }
    json = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(json, json_boolean(isfinite(sigma[i])));
    }
    return json;
}

static bool all_finite(const double *numbers, size_t count) {
    size_t i = 0;
    while (i < count && isfinite(numbers[i])) {
        i++;
    }
    return i == count;
}

json_t *model_to_json(const model_t *model) {
    json_t *json = json_pack("{s:s, s:f}", "format", FORMAT, "sample_rate_hz", model->sample_rate_hz);
    json_t *chain = json_array();
    for (size_t i = 0; i < model->blocks; i++) {
        const model_block_t *block = &model->block[i];
        json_t *parameters = json_object();
        for (size_t p = 0; p < block->block->parameters; p++) {
            const parameter_info_t *info = &block->block->parameter[p];
            const parameter_t *parameter = &block->parameter[p];
            const bool absent =
                info->optional && (info->array ? parameter->count == 0 : parameter->value[0] == info->default_value);
            json_t *entry;
            if (absent) {
                continue;
            }
            entry = json_pack("{s:o, s:s}", "value", numbers_to_json(parameter->value, parameter->count, info->array),
                              "unit", info->unit);
            if (parameter->sigma != NULL) {
                json_object_set_new(entry, "sigma", numbers_to_json(parameter->sigma, parameter->count, info->array));
                if (!all_finite(parameter->sigma, parameter->count)) {
                    json_object_set_new(entry, "determined",
                                        determined_to_json(parameter->sigma, parameter->count, info->array));
                }
            }
            json_object_set_new(parameters, info->name, entry);
        }
        json_array_append_new(chain, json_pack("{s:s, s:o}", "block", block->block->name, "parameters", parameters));
    }
    json_object_set_new(json, "chain", chain);
    if (model->fit != NULL) {
        json_object_set_new(json, "fit", json_deep_copy(model->fit));
    }
    return json;
}

bool model_write(const model_t *model, const char *path, failure_t *failure) {
    return json_write(model_to_json(model), path, failure);
}
