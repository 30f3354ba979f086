/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "synthetic.h"
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "unity.h"
#include <math.h>

#define LONGEST_V    50.0 /* thresholds reach half of the range */
#define DECAY_V      15.0
#define REVERSIBLE   0.65 /* um/V */
#define IRREVERSIBLE 0.35

void synthetic_model(model_t *model, size_t operators, double gain) {
    double weights[401];
    double thresholds[400];
    TEST_ASSERT_LESS_OR_EQUAL_UINT(400, operators);
    const double all = 1.0 - exp(-LONGEST_V / DECAY_V);
    weights[0] = gain * REVERSIBLE;
    for (size_t i = 0; i < operators; i++) {
        const double from = LONGEST_V * (double)i / (double)operators;
        const double to = LONGEST_V * (double)(i + 1) / (double)operators;
        thresholds[i] = (from + to) / 2.0;
        weights[i + 1] = gain * IRREVERSIBLE * (exp(-from / DECAY_V) - exp(-to / DECAY_V)) / all;
    }
    model_create(model, SYNTHETIC_RATE_HZ);
    model_block_t *block = model_append(model, catalogue_find("prandtl_ishlinskii"));
    model_set(block, "offset_um", 2.0);
    model_set_array(block, "weights", operators + 1, weights, NULL);
    model_set_array(block, "thresholds_v", operators, thresholds, NULL);
    model->fit = json_pack("{s:[ff], s:[ff]}", "drive_range_v", 0.0, 100.0, "displacement_range_um", 0.0, 105.0);
}

hyst_parameters_t synthetic_parameters(size_t operators, double gain) {
    model_t model;
    hyst_parameters_t parameters;
    failure_t failure;
    const compile_options_t options = {0};
    synthetic_model(&model, operators, gain);
    const bool compiled = compile_model(&model, &options, &parameters, NULL, &failure);
    model_free(&model);
    TEST_ASSERT_TRUE_MESSAGE(compiled, failure.text);
    return parameters;
}
