/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "seed_002_track.h"
#include "compile/compile.h"
#include "twins/twin_002.h"
#include <math.h>

typedef struct {
    twin_002_t twin;
    double position_um;
} held_twin_t;

static double sample(void *state, double drive_v) {
    held_twin_t *held = state;
    const double measured = twin_002_measure(&held->twin, held->position_um);
    held->twin.drive_v = drive_v; /* at once, and then held */
    held->position_um = twin_002_step(&held->twin, drive_v);
    return measured;
}

bool track_002(const model_t *model, hyst_mode_t mode, double hz, double middle_um, double range_um, uint64_t seed,
               tracking_error_t *error, failure_t *failure) {
    const double rate_hz = model->sample_rate_hz;
    /* A drive that is held acts on the next sample: one sample of latency. */
    const compile_options_t options = {
        .drive_range_v = {0.0, 75.0}, .position_range_um = {-2.0, 24.0}, .delay_s = 1.0 / rate_hz};
    const sine_track_t sine = {.mode = mode,
                               .offset_um = middle_um,
                               .amplitude_um = 0.5 * range_um,
                               .frequency_hz = hz,
                               .settle_s = fmax(4.0 / hz, 5.0), /* three time constants of the slowest relaxation */
                               .samples = (size_t)lround(2.0 * rate_hz / hz)};
    held_twin_t held = {.position_um = 0.0};
    hyst_parameters_t image;
    recording_t recording;
    twin_002_open(&held.twin, &twin_002_actuator, rate_hz, seed);
    if (!compile_model(model, &options, &image, NULL, failure) ||
        !amplifier_track(&image, &(actuator_t){&held, sample}, &sine, &recording, failure)) {
        return false;
    }
    *error = tracking_error(&recording, range_um);
    recording_free(&recording);
    return true;
}
