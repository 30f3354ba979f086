/* SPDX-License-Identifier: GPL-3.0-or-later */
/* White Gaussian noise of the position sensor. The same seed gives the same noise. */
#include "chain/catalogue.h"
#include <gsl/gsl_math.h>

static const parameter_info_t parameters[] = {
    {.name = "rms_um", .unit = "um", .low = 0.0, .high = 1e6, .text = "standard deviation of one sample"}};

typedef struct {
    double rms_um;
    uint64_t random;
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->rms_um = parameter[0].value[0];
    state->random = setup->seed;
}

/* SplitMix64 (Steele, Lea, Flood 2014), scaled to (0, 1]. */
static double uniform(state_t *state) {
    uint64_t z = (state->random += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    z ^= z >> 31;
    return ((double)(z >> 11) + 1.0) * 0x1p-53;
}

static void settle(void *memory, signal_t *signal) {
    (void)memory;
    (void)signal;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double radius = sqrt(-2.0 * log(uniform(state))); /* Box and Muller; the second value is not used */
    signal->value += state->rms_um * radius * cos(2.0 * M_PI * uniform(state));
}

const block_t block_sensor_noise = {.name = "sensor_noise",
                                    .place = PLACE_SENSOR,
                                    .order = 50,
                                    .adds = true,
                                    .text = "white noise of the position sensor",
                                    .readings = READINGS_NOISY,
                                    .parameter = parameters,
                                    .parameters = 1,
                                    .state_bytes = sizeof(state_t),
                                    .open = open,
                                    .settle = settle,
                                    .step = step,
                                    .uncorrected = "it is on the reading; the position does not have it"};
