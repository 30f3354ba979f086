/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rounding of the position to the converter's steps. */
#include "chain/catalogue.h"
#include <math.h>

static const parameter_info_t parameters[] = {
    {.name = "step_um", .unit = "um", .low = 1e-12, .high = 1e6, .chosen = true, .text = "size of one step"}};

static void open(void *state, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(double *)state = parameter[0].value[0];
}

static void quantise(void *state, signal_t *signal) {
    const double step_um = *(const double *)state;
    signal->value = step_um * floor(signal->value / step_um + 0.5);
}

/* No signature: the steps show in the readings themselves (diagnosis/lattice.h). */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    (void)setting;
    (void)index;
    (void)value;
    return false;
}

static const probe_t looked_for = {
    .group = "quantisation",
    .explanation =
        "Every reading is a multiple of one step: the resolution of the converter, or of what wrote the file.",
    .excitation = "any motion over many steps",
    .parts = PROBE_SILENCE | PROBE_FAST_TRIANGLE,
    .probe = probe,
    .searched = 1U};

const block_t block_quantisation = {.name = "quantisation",
                                    .place = PLACE_SENSOR,
                                    .order = 60,
                                    .adds = true,
                                    .text = "steps of the position converter",
                                    .readings = READINGS_STEPPED,
                                    .parameter = parameters,
                                    .parameters = 1,
                                    .state_bytes = sizeof(double),
                                    .open = open,
                                    .settle = quantise,
                                    .step = quantise,
                                    .uncorrected = "it is on the reading; the position does not have it",
                                    .probe = &looked_for};
