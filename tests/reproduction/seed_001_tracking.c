/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Compensation in paper 001: direct inverse multiplication as printed, and both inverses of lib/hyst. */
#include "compile/compile.h"
#include "elements/play_plane.h"
#include "elements/recursion.h"
#include "numerics/sine_fit.h"
#include "seed_001.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Asks for the drive, as a fraction of its half range, that brings the displacement to the reference. */
typedef double (*compensate_t)(void *compensator, double reference_um);

static double power_at(const recording_t *recording, double frequency_hz) {
    sine_t sine;
    failure_t failure;
    return sine_fit_at(recording->column[COLUMN_DISPLACEMENT], recording->samples, TWIN_001_RATE_HZ, frequency_hz,
                       &sine, &failure)
               ? sine.amplitude * sine.amplitude
               : (double)NAN;
}

/* It grows over the first second. */
static double reference(double frequency_hz, size_t k) {
    const double t = (double)k / TWIN_001_RATE_HZ;
    return SEED_001_REFERENCE_UM * fmin(1.0, t) * sin(2.0 * M_PI * frequency_hz * t);
}

/* Two seconds to come in, then what is measured. */
static seed_001_tracked_t track(double frequency_hz, size_t lookahead, double half_range_v, compensate_t compensate,
                                void *compensator) {
    const double periods = fmax(2.0, floor(frequency_hz));
    const size_t settle = (size_t)(2.0 * TWIN_001_RATE_HZ);
    const size_t samples = (size_t)floor(periods / frequency_hz * TWIN_001_RATE_HZ + 0.5);
    seed_001_tracked_t tracked = {0};
    recording_t recording;
    twin_001_t twin;
    double position_um = 0.0, squares = 0.0;
    recording_create(&recording, "tracked", TWIN_001_RATE_HZ, samples);
    twin_001_open(&twin, 11);
    for (size_t k = 0; k < settle + samples; k++) {
        const double drive_v = half_range_v * compensate(compensator, reference(frequency_hz, k + lookahead));
        if (k >= settle) {
            recording.column[COLUMN_DISPLACEMENT][k - settle] = position_um;
            squares += gsl_pow_2(reference(frequency_hz, k) - position_um);
            tracked.drive_v = fmax(tracked.drive_v, fabs(drive_v));
        }
        position_um = twin_001_step(&twin, drive_v);
    }
    tracked.rms_um = sqrt(squares / (double)samples);
    tracked.third_power = power_at(&recording, 3.0 * frequency_hz) / power_at(&recording, frequency_hz);
    recording_free(&recording);
    return tracked;
}

/* ---- as printed ---- */

typedef struct {
    double offset_um, direct_um, limit;
    const parameter_t *cells;
    double *cell; /* of the last sample */
    play_plane_t plane;
    recursion_t recursion;
} direct_t;

static double plane_um(const direct_t *direct) {
    double sum = direct->offset_um;
    for (size_t i = 0; i < direct->cells->count; i++) {
        sum += direct->cells->value[i] * direct->cell[i];
    }
    return sum;
}

/* u = (y_d - H) / 2A, where H has the plays of the last sample and takes the past references for the positions. */
static double compensate_directly(void *compensator, double reference_um) {
    direct_t *direct = compensator;
    recursion_t ahead = direct->recursion;
    const double known = recursion_step(&ahead, plane_um(direct), 0.0);
    double u = (reference_um - known) / direct->direct_um;
    u = u >= -direct->limit && u <= direct->limit ? u : u < 0.0 ? -direct->limit : direct->limit;
    play_plane_step(&direct->plane, u, direct->cell);
    recursion_step(&direct->recursion, 0.0, u);
    direct->recursion.output[0] = reference_um;
    return u;
}

seed_001_tracked_t seed_001_track_directly(const model_t *model, double frequency_hz) {
    const model_block_t *block = &model->block[0];
    const stage_setup_t setup = {.sample_rate_hz = TWIN_001_RATE_HZ};
    const size_t recursion_at = block->block->parameters - RECURSION_PARAMETERS;
    direct_t direct = {.offset_um = model_parameter(block, "offset_um")->value[0],
                       .direct_um = model_parameter(block, "direct_um")->value[0],
                       .cells = model_parameter(block, "cells_um")};
    const double half_range_v = model_parameter(block, "half_range_v")->value[0];
    direct.limit = TWIN_001_RANGE_V / half_range_v;
    direct.cell = allocate(direct.cells->count, sizeof(double));
    play_plane_open(&direct.plane, play_plane_divisions(direct.cells->count), 0.0, 0.0, TWIN_001_RATE_HZ);
    play_plane_settle(&direct.plane, 0.0, direct.cell);
    recursion_open(&direct.recursion, block->parameter + recursion_at, &setup);
    const seed_001_tracked_t tracked = track(frequency_hz, 0, half_range_v, compensate_directly, &direct);
    free(direct.cell);
    return tracked;
}

/* ---- in lib/hyst ---- */

typedef struct {
    hyst_modified_play_t model;
    hyst_modified_play_state_t state;
    double full_scale_um;
    bool exact;
} amplifier_t;

static double compensate_in_amplifier(void *compensator, double reference_um) {
    amplifier_t *amplifier = compensator;
    const hyst_q31_t position = (hyst_q31_t)lrint(ldexp(reference_um / amplifier->full_scale_um, 31));
    bool saturated = false;
    const hyst_q31_t drive =
        amplifier->exact
            ? hyst_modified_play_solve(&amplifier->model, &amplifier->state, position, &saturated)
            : hyst_modified_play_direct_inverse(&amplifier->model, &amplifier->state, position, &saturated);
    hyst_modified_play_advance(&amplifier->model, &amplifier->state, drive);
    return ldexp((double)drive, -31);
}

bool seed_001_track_in_amplifier(const model_t *model, double frequency_hz, const seed_001_control_t *control,
                                 seed_001_tracked_t *tracked, failure_t *failure) {
    const double half_range_v = model_parameter(&model->block[0], "half_range_v")->value[0];
    const double full_scale_um = 1.1 * SEED_001_REFERENCE_UM;
    const compile_options_t options = {.drive_range_v = {-half_range_v, half_range_v},
                                       .position_range_um = {-full_scale_um, full_scale_um}};
    const double turns = control->lead_rad / (2.0 * M_PI) - frequency_hz / TWIN_001_RATE_HZ;
    amplifier_t amplifier = {.full_scale_um = full_scale_um, .exact = control->exact};
    hyst_parameters_t image;
    uint32_t element;
    if (!compile_model(model, &options, &image, NULL, failure)) {
        return false;
    }
    image.modified_play[0].phase = (uint32_t)llrint(ldexp(turns - floor(turns), 32));
    if (hyst_modified_play_build(&amplifier.model, &image.modified_play[0], &element) != HYST_MODIFIED_PLAY_OK) {
        return fail(failure, "the image was accepted, and its hysteresis is not");
    }
    hyst_modified_play_reset(&amplifier.model, &amplifier.state, 0);
    *tracked = track(frequency_hz, control->lookahead, half_range_v, compensate_in_amplifier, &amplifier);
    return true;
}
