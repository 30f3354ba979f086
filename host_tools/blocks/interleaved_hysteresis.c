/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The bilinear term of paper 001, which bends a loop until it crosses itself, after any hysteresis:
 *
 *     y[k] = h[k] + g y[k-1] u[k-1],      u = (drive - center) / half range
 *
 * The product is known before the sample, so h follows from y exactly. docs/MODELS.md, section 9. At another sample
 * rate the delay of the product changes, which matters little while the product is small.
 */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"

enum { GAIN, CENTER, HALF_RANGE };

static const parameter_info_t parameters[] = {
    {.name = "bilinear_gain",
     .proportional = true,
     .unit = "1",
     .low = -0.99,
     .high = 0.99,
     .text = "g: part of the last position that the last drive, as a fraction of its half range, adds"},
    PARAMETER_CENTER("center_v", "V", "drive_range_v", "drive that counts as 0"),
    PARAMETER_HALF_RANGE("half_range_v", "V", "drive_range_v", "drive above center_v that counts as 1")};

typedef struct {
    double gain, center_v, half_range_v;
    double product; /* g y u of the last sample */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory = (state_t){.gain = parameter[GAIN].value[0],
                                   .center_v = parameter[CENTER].value[0],
                                   .half_range_v = parameter[HALF_RANGE].value[0]};
}

/* Feedback factor of the last position. It stays below 1 beyond the half range, too, or the position would diverge. */
static double factor(const state_t *state, double drive_v) {
    const double u = (drive_v - state->center_v) / state->half_range_v;
    return state->gain * (u < -1.0 ? -1.0 : u > 1.0 ? 1.0 : u);
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double part = factor(state, signal->drive_v);
    signal->value /= 1.0 - part;
    state->product = part * signal->value;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    signal->value += state->product;
    state->product = factor(state, signal->drive_v) * signal->value;
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[GAIN] = 0.005;
    probe_range(setting->drive_low_v, setting->drive_high_v, &value[CENTER], &value[HALF_RANGE]);
    return index == 0;
}

static const probe_t looked_for = {
    .group = "shape",
    .explanation = "Position and drive multiply: the loop bends, and crosses itself where the position is delayed.",
    .excitation = "the same loops about two bias levels, fast and slow",
    .shape = true,
    .parts = PROBE_LOOPS | PROBE_FAST_TRIANGLE,
    .probe = probe,
    .searched = 1U << GAIN,
    .accuracy = {0.02}};

const block_t block_interleaved_hysteresis = {
    .name = "interleaved_hysteresis",
    .place = PLACE_HYSTERESIS,
    .order = 110,
    .follows_hysteresis = true,
    .text = "product of position and drive, which makes loops cross themselves",
    .parameter = parameters,
    .parameters = 3,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "the amplifier undoes a product of position and drive only "
                   "as bilinear_gain of block modified_play",
    .probe = &looked_for};
