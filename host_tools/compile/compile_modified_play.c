/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_modified_play.h"
#include "chain/chain.h"
#include "elements/play_plane.h"
#include "elements/recursion.h"
#include "numerics/sine_fit.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

/* Ranges in an image are whole microvolts, so ranges that differ by less than this fraction are equal. */
static const double same_range = 1e-6;

/* Periods of the simulation that finds the phase lead of the drive: first those for the transient, then those that are
 * evaluated. */
enum { SETTLING_TURNS = 40, COUNTED_TURNS = 10 };

/* The amplifier's plane: its divisions are as wide as the model's, and it extends `half_v` to both sides of its
 * center. */
typedef struct {
    uint32_t divisions;
    double stretch; /* half_v over the half range of the model */
} plane_t;

/* The cell borders of both planes coincide only if both numbers of divisions are even, or both odd. */
static bool choose_plane(compile_job_t *job, const modified_play_numbers_t *numbers, plane_t *plane) {
    const double center_v = numbers->recursion[RECURSION_CENTER].value[0],
                 half_v = numbers->recursion[RECURSION_HALF_RANGE].value[0];
    const double needed_v = job->drive_half_v + fabs(job->drive_center_v - center_v);
    size_t divisions = numbers->divisions;
    while (half_v * (double)divisions < (1.0 - same_range) * needed_v * (double)numbers->divisions) {
        divisions += 2;
    }
    if (divisions > HYST_MODIFIED_PLAY_MAX_DIVISIONS) {
        return fail(job->failure,
                    "its %zu divisions cover %g +- %g V, the drive converter would need %zu of them, the amplifier has "
                    "%d: fit fewer (--operators), or give a smaller --drive-range",
                    numbers->divisions, center_v, half_v, divisions, HYST_MODIFIED_PLAY_MAX_DIVISIONS);
    }
    *plane = (plane_t){.divisions = (uint32_t)divisions, .stretch = (double)divisions / (double)numbers->divisions};
    return true;
}

/* The drive curve, which may exist already, maps to fractions of the plane's range. Equal ranges need no curve. */
static bool set_curve(compile_job_t *job, double center_v, double half_v) {
    hyst_parameters_t *p = job->parameters;
    if (fabs(job->drive_center_v - center_v) + fabs(job->drive_half_v - half_v) <= same_range * half_v) {
        return true;
    }
    for (int i = 0; i < HYST_CURVE_NODES; i++) {
        const double x =
            p->drive_curves > 0 ? p->drive_curve[0].node[i] * 0x1p-31 : 2.0 * i / HYST_CURVE_INTERVALS - 1.0;
        const double node = (job->drive_center_v + x * job->drive_half_v - center_v) / half_v;
        if (!compile_to_fixed(job, fmax(-1.0, fmin(node, 1.0 - 0x1p-31)), 31, "the drive curve",
                              &p->drive_curve[0].node[i])) {
            return false;
        }
    }
    p->drive_curves = 1;
    job->drive_center_v = center_v;
    job->drive_half_v = half_v;
    return true;
}

/* The model's cells in the middle of the amplifier's larger plane. */
static bool set_cells(compile_job_t *job, const modified_play_numbers_t *numbers, const plane_t *plane) {
    hyst_modified_play_parameters_t *play = &job->parameters->modified_play[0];
    const size_t margin = (plane->divisions - numbers->divisions) / 2;
    const double *cell = numbers->cell_um;
    size_t row = 0; /* first element of this row in the amplifier's plane */
    for (size_t i = 1; i < numbers->divisions; i++) {
        for (size_t j = 0; j < numbers->divisions - i; j++) {
            if (!compile_to_fixed(job, *cell++ * plane->divisions / job->elastic_half_um, 28, "a cell",
                                  &play->slope[row + margin + j])) {
                return false;
            }
        }
        row += plane->divisions - i;
    }
    return true;
}

/*
 * With y = center + half Y and u = stretch U, the product g y u becomes g stretch Y U plus a term in the last drive
 * alone. That term is stored as a cosine that stands still, unless the harmonics use the cosine.
 */
static bool set_recursion(compile_job_t *job, const modified_play_numbers_t *numbers, const plane_t *plane) {
    hyst_modified_play_parameters_t *play = &job->parameters->modified_play[0];
    const parameter_t *feedback = &numbers->recursion[RECURSION_FEEDBACK_TERMS],
                      *harmonic = &numbers->recursion[RECURSION_HARMONIC_TERMS];
    const double gain = numbers->recursion[RECURSION_BILINEAR].value[0] * plane->stretch;
    double past = 0.0, last_drive = gain * job->elastic_center_um / job->elastic_half_um, power = plane->stretch;
    for (size_t i = 0; i < feedback->count; i++) {
        past += feedback->value[i];
        if (!compile_to_fixed(job, feedback->value[i], 28, "feedback", &play->feedback[i])) {
            return false;
        }
    }
    if (harmonic->count > 0 && fabs(last_drive) > 0x1p-28) {
        return fail(job->failure,
                    "bilinear_gain with harmonics takes a position converter whose middle is 0 um, not %g: give "
                    "--position-range",
                    job->elastic_center_um);
    }
    for (size_t i = 0; i < HYST_MODIFIED_PLAY_HARMONICS && harmonic->count > 0; i++) {
        const double unit = power / job->elastic_half_um;
        if (!compile_to_fixed(job, harmonic->value[i] * unit, 28, "harmonics_um", &play->sine[i]) ||
            !compile_to_fixed(job, harmonic->value[HYST_MODIFIED_PLAY_HARMONICS + i] * unit, 28, "harmonics_um",
                              &play->cosine[i])) {
            return false;
        }
        power *= plane->stretch * plane->stretch;
    }
    return (harmonic->count > 0 ||
            compile_to_fixed(job, last_drive, 28, "bilinear_gain of the middle position", &play->cosine[0])) &&
           compile_to_fixed(job, gain, 28, "bilinear_gain", &play->bilinear) &&
           compile_to_fixed(job, (numbers->offset_um - job->elastic_center_um * (1.0 - past)) / job->elastic_half_um,
                            31, "offset_um", &play->offset) &&
           compile_to_fixed(job, numbers->direct_um * plane->stretch / job->elastic_half_um, 28, "direct_um",
                            &play->direct) &&
           compile_to_fixed(job, numbers->fall_s * job->rate_hz, 20, "alpha in samples", &play->alpha) &&
           compile_to_fixed(job, numbers->rise_s * job->rate_hz, 20, "beta in samples", &play->beta);
}

static uint32_t turns(double fraction) {
    return (uint32_t)(uint64_t)floor((fraction - floor(fraction)) * 0x1p32 + 0.5); /* 2^32 is 0 again */
}

/* Phase by which the drive leads the resulting position at the frequency of the harmonics, in turns. */
static bool find_lead(compile_job_t *job, const modified_play_numbers_t *numbers, double *lead) {
    const parameter_t *recursion = numbers->recursion;
    const double hz = recursion[RECURSION_FREQUENCY].value[0], start = recursion[RECURSION_PHASE].value[0];
    const size_t first = (size_t)ceil(SETTLING_TURNS * job->rate_hz / hz),
                 counted = (size_t)ceil(COUNTED_TURNS * job->rate_hz / hz);
    double *position = allocate(counted, sizeof *position);
    model_t model;
    sine_t sine;
    bool good;
    model_copy_place(&model, job->model, PLACE_HYSTERESIS);
    chain_t *chain = chain_open(&model, job->rate_hz, 0, job->failure);
    model_free(&model);
    good = chain != NULL;
    for (size_t k = 0; good && k < first + counted; k++) {
        const double drive_v =
            recursion[RECURSION_CENTER].value[0] +
            recursion[RECURSION_HALF_RANGE].value[0] * sin(start + 2.0 * M_PI * hz * (double)k / job->rate_hz);
        if (k == 0) {
            chain_settle(chain, drive_v);
        }
        const double value = chain_step(chain, drive_v);
        if (k >= first) {
            position[k - first] = value;
        }
    }
    if (chain != NULL) {
        chain_close(chain);
    }
    good = good && sine_fit_at(position, counted, job->rate_hz, hz, &sine, job->failure);
    free(position);
    if (good) {
        *lead = (start - sine.phase) / (2.0 * M_PI) + hz * (double)first / job->rate_hz;
    }
    return good;
}

static bool set_phase(compile_job_t *job, const modified_play_numbers_t *numbers) {
    hyst_modified_play_parameters_t *play = &job->parameters->modified_play[0];
    const double hz = numbers->recursion[RECURSION_FREQUENCY].value[0];
    double lead = 0.0;
    if (numbers->recursion[RECURSION_HARMONIC_TERMS].count == 0) {
        return true; /* theta rests at 0, where the cosine is 1 */
    }
    if (hz >= 0.5 * job->rate_hz) {
        return fail(job->failure, "frequency_hz = %g is not below half the sample rate", hz);
    }
    if (!find_lead(job, numbers, &lead)) {
        return false;
    }
    play->phase = turns(lead);
    play->phase_step = turns(hz / job->rate_hz);
    compile_note(job, "%s: its harmonics belong to a sine of %.6g Hz, which the source has to play (it locks them)",
                 job->block, hz);
    return true;
}

bool compile_modified_play(compile_job_t *job, const modified_play_numbers_t *numbers) {
    hyst_parameters_t *p = job->parameters;
    const double center_v = numbers->recursion[RECURSION_CENTER].value[0],
                 half_v = numbers->recursion[RECURSION_HALF_RANGE].value[0];
    plane_t plane = {0};
    if (job->rate_hz != job->model->sample_rate_hz) {
        return fail(job->failure, "its numbers belong to %g samples per second, not to %g", job->model->sample_rate_hz,
                    job->rate_hz);
    }
    if (!choose_plane(job, numbers, &plane) || !set_phase(job, numbers) ||
        !set_curve(job, center_v, plane.stretch * half_v)) {
        return false;
    }
    p->family = HYST_FAMILY_MODIFIED_PLAY;
    p->modified_plays = 1;
    p->modified_play[0].divisions = plane.divisions;
    p->modified_play[0].rate_gain = HYST_Q30_ONE;
    job->report->model_operators = numbers->divisions;
    return set_cells(job, numbers, &plane) && set_recursion(job, numbers, &plane);
}
