/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * No physical effect: a smooth curve of the position behind everything else, for a bend that no effect of the catalogue
 * has. With the knots evenly over the range of the displacement,
 *
 *     reading = position + curve(position)
 *
 * It is 0 at both ends of the range, since a gain and an offset are the hysteresis' own, and goes on straight beyond.
 */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include "compile/compile_job.h"
#include "elements/knot_curve.h"
#include <math.h>

enum { VALUES = KNOT_CURVE_INTERVALS - 1, CENTER = VALUES, HALF_RANGE, PARAMETERS };

#define KNOT(number)                                                                                                   \
    {                                                                                                                  \
        .name = "knot_" #number "_um", .proportional = true, .unit = "um", .low = -1e6, .high = 1e6,                   \
        .text = "change of the reading at " #number "/8 of the range"                                                  \
    }

static const parameter_info_t parameters[PARAMETERS] = {
    KNOT(1),
    KNOT(2),
    KNOT(3),
    KNOT(4),
    KNOT(5),
    KNOT(6),
    KNOT(7),
    PARAMETER_CENTER("center_um", "um", "displacement_range_um", "middle of the range"),
    PARAMETER_HALF_RANGE("half_range_um", "um", "displacement_range_um", "half of the range over which the knots are")};

typedef struct {
    knot_curve_t curve;
    double low_um, interval_um;
} state_t;

static state_t state_of(const parameter_t *parameter) {
    const double half_um = parameter[HALF_RANGE].value[0];
    state_t state = {.low_um = parameter[CENTER].value[0] - half_um,
                     .interval_um = 2.0 * half_um / KNOT_CURVE_INTERVALS};
    double value[KNOT_CURVE_KNOTS] = {0.0};
    for (size_t i = 0; i < VALUES; i++) {
        value[i + 1] = parameter[i].value[0];
    }
    knot_curve_make(value, &state.curve);
    return state;
}

static bool check(const parameter_t *parameter, failure_t *failure) {
    const state_t state = state_of(parameter);
    return state.interval_um + knot_curve_least_slope(&state.curve) > 0.0 ||
           fail(failure, "with these values the reading falls where the position rises");
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory = state_of(parameter);
}

static double reading_of(const state_t *state, double position_um) {
    return position_um + knot_curve_at(&state->curve, (position_um - state->low_um) / state->interval_um);
}

static void step(void *memory, signal_t *signal) {
    signal->value = reading_of(memory, signal->value);
}

/* By halving, from a stretch that has the reading in it: beyond the range it goes on straight, and rises. */
static double position_of(const void *memory, double reading_um) {
    enum { HALVINGS = 60 };
    const state_t *state = memory;
    double low = state->low_um, high = state->low_um + KNOT_CURVE_INTERVALS * state->interval_um;
    while (reading_of(state, low) > reading_um) {
        low -= high - low;
    }
    while (reading_of(state, high) < reading_um) {
        high += high - low;
    }
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = 0.5 * (low + high);
        *(reading_of(state, middle) < reading_um ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const state_t state = state_of(parameter);
    if (job->options->follow_position) {
        compile_uncorrected(job, "whether the position or only its reading is bent is not known");
        return true;
    }
    if (!compile_reference_curve(job, position_of, &state)) {
        return false;
    }
    compile_note(job, "%s: the reading follows the reference", job->block);
    return true;
}

/* It is linear in its values, so that any beginning will do. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    probe_range(setting->displacement_low_um, setting->displacement_high_um, &value[CENTER], &value[HALF_RANGE]);
    return index == 0;
}

static const probe_t fitted = {
    .explanation =
        "No known effect fits. This smooth curve of the position describes it, without a cause. Contact that "
        "is lost below a position looks like it, a sensor of any curve, and a hysteresis with dead zones "
        "behind its plays.",
    .excitation = "the same loops with the sensor shifted, or a second sensor",
    .probe = probe,
    .searched = (1U << VALUES) - 1U};

const block_t block_empirical_curve = {.name = "empirical_curve",
                                       .place = PLACE_SENSOR,
                                       .order = 100,
                                       .adds = true,
                                       .text = "no physical effect: a smooth curve of the position",
                                       .parameter = parameters,
                                       .parameters = PARAMETERS,
                                       .check = check,
                                       .state_bytes = sizeof(state_t),
                                       .open = open,
                                       .settle = step,
                                       .step = step,
                                       .compile = compile,
                                       .empirical = &fitted};
