/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Rows of parameter tables (block.h) that several blocks share. */
#ifndef PARAMETER_ROWS_H
#define PARAMETER_ROWS_H

#include "chain/block.h"

/** The middle and half the width of the range to which other parameters of the block refer. `unit`: "V" or "um";
 * `range`: the range of the model's "fit" that applies where a model file omits them. probe_range() fills them. */
#define PARAMETER_CENTER(its_name, its_unit, range, its_text)                                                          \
    {                                                                                                                  \
        .name = (its_name), .unit = (its_unit), .low = -1e9, .high = 1e9, .chosen = true, .center_of = (range),        \
        .text = (its_text)                                                                                             \
    }
#define PARAMETER_HALF_RANGE(its_name, its_unit, range, its_text)                                                      \
    {                                                                                                                  \
        .name = (its_name), .unit = (its_unit), .low = 1e-9, .high = 1e9, .chosen = true, .half_of = (range),          \
        .text = (its_text)                                                                                             \
    }

/** Initial memory of an array of operators, or the past drive: a state, usually absent. */
#define PARAMETER_MEMORY(its_name, its_unit, its_text)                                                                 \
    {                                                                                                                  \
        .name = (its_name), .unit = (its_unit), .low = -1e9, .high = 1e9, .array = true, .optional = true,             \
        .chosen = true, .text = (its_text)                                                                             \
    }
/** The same for a scalar. */
#define PARAMETER_INITIAL(its_name, its_unit, its_text)                                                                \
    {                                                                                                                  \
        .name = (its_name), .unit = (its_unit), .low = -1e9, .high = 1e9, .array = true, .most = 1, .optional = true,  \
        .chosen = true, .text = (its_text)                                                                             \
    }

/** The bank of operators that check_operators() checks: the weights (the first one is the direct weight of the input)
 * and the thresholds, followed by its PARAMETER_MEMORY. */
#define PARAMETER_WEIGHTS(its_unit, its_text)                                                                          \
    { .name = "weights", .unit = (its_unit), .low = -1e9, .high = 1e9, .array = true, .text = (its_text) }
#define PARAMETER_THRESHOLDS(its_name, its_unit, its_text)                                                             \
    {                                                                                                                  \
        .name = (its_name), .unit = (its_unit), .low = 1e-12, .high = 1e9, .array = true, .rising = true,              \
        .chosen = true, .text = (its_text)                                                                             \
    }
/** Levels or frequencies of a table, chosen and strictly rising from `lowest` on. */
#define PARAMETER_LEVELS(its_name, its_unit, lowest, its_text)                                                         \
    {                                                                                                                  \
        .name = (its_name), .unit = (its_unit), .low = (lowest), .high = 1e9, .array = true, .rising = true,           \
        .chosen = true, .text = (its_text)                                                                             \
    }

#endif
