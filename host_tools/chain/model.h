/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A model: an ordered list of blocks with numbers in them, stored as JSON (format hyst-model-1).
 *
 *     {"format": "hyst-model-1", "sample_rate_hz": 10000,
 *      "chain": [{"block": "transport_delay",
 *                 "parameters": {"delay_s": {"value": 3.0e-4, "sigma": 2e-6, "unit": "s"}}},
 *                {"block": "prandtl_ishlinskii",
 *                 "parameters": {"offset_um": {"value": 1.5}, "weights": {"value": [0.1, 0.02]}, ...}}],
 *      "fit": {...}}
 *
 * A parameter that refers to a range may be absent: half_range_um of static_nonlinearity is then half of the fit's
 * displacement_range_um (center_of, half_of in block.h).
 *
 * A parameter is an object with "value" and optionally "sigma" (one standard error) and "unit", or just the value. An
 * array parameter has an array for "value" and, if present, for "sigma". A number that the recordings do not determine
 * has null for its sigma, and false under "determined". Reading is strict: an unknown block or parameter, a missing or
 * out-of-range one, or a wrong type is refused with one line that says where.
 */
#ifndef MODEL_H
#define MODEL_H

#include "chain/block.h"
#include <jansson.h>

#define MODEL_MAX_BLOCKS 32

/** One block of a model with its parameter values, in the order of block->parameter. */
typedef struct {
    const block_t *block;
    parameter_t parameter[BLOCK_MAX_PARAMETERS];
} model_block_t;

typedef struct {
    double sample_rate_hz; /**< highest of the recordings it was made from, or of the amplifier it is meant for */
    size_t blocks;
    model_block_t block[MODEL_MAX_BLOCKS];
    /**
     * Facts about the fit, kept as they were read: a JSON object or NULL. Keys that other code uses, all optional:
     * "drive_range_v", "displacement_range_um" and those of the converters (fit_ranges.h) [low, high], "nrmse_percent",
     * "held_out_nrmse_percent", "recordings" [...], "notes" [remarks of the family, a line each].
     */
    json_t *fit;
} model_t;

bool model_read(model_t *model, const char *path, failure_t *failure);
/** `where` stands for the path in messages. */
bool model_from_json(model_t *model, const json_t *json, const char *where, failure_t *failure);
bool model_write(const model_t *model, const char *path, failure_t *failure);
/** A new reference. */
json_t *model_to_json(const model_t *model);
void model_free(model_t *model);

/** Copies a model with all its numbers; free both. */
void model_copy(model_t *copy, const model_t *model);
/** Whether both have the same blocks with the same numbers; in which order, and of what fit, does not count. */
bool model_same_blocks(const model_t *one, const model_t *other);
/** Copies the blocks of one place, without the fit. */
void model_copy_place(model_t *copy, const model_t *model, place_t place);

/** Empties *model for model_append. */
void model_create(model_t *model, double sample_rate_hz);
/** Appends a block with absent optional parameters at their defaults and the others 0 / empty: set them all. The model
 * must have room. */
model_block_t *model_append(model_t *model, const block_t *block);
/** Removes the block at an index. */
void model_remove(model_t *model, size_t index);
/** The same of a block that the model has. */
void model_remove_block(model_t *model, const block_t *block);
/** Takes noise and sensor steps out: they are no response to a drive. */
void model_without_noise(model_t *model);
/** Sets a parameter by name. sigma may be NULL. The block must have such a parameter (a programming error otherwise).
 */
void model_set(model_block_t *block, const char *name, double value);
void model_set_array(model_block_t *block, const char *name, size_t count, const double *value, const double *sigma);

/** The model's block of that name, or NULL. */
const model_block_t *model_find(const model_t *model, const char *block_name);
/** The time of a block that is a pure lag (lag_t); HUGE_VAL of all others. */
double model_lag_s(const model_block_t *block);
/** A parameter of a block by name; the block must have it. */
const parameter_t *model_parameter(const model_block_t *block, const char *name);

/** The same checks as reading: ranges, lengths, exactly one hysteresis. `where` begins the message. */
bool model_check(const model_t *model, const char *where, failure_t *failure);

/** Of a range that a model was fitted to, beyond either end: converters reach so far by default (5 % in all), and so
 * far a model may be driven. */
#define MODEL_RANGE_MARGIN 0.025

/** Reads a [low, high] pair of the fit object. Returns false when there is none. */
bool model_fit_range(const model_t *model, const char *key, double range[2]);

#endif
