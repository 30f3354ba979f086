/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The supply rails: the voltage stays between them. */
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "compile/compile_job.h"
#include <math.h>

enum { LOW, HIGH };

static const parameter_info_t parameters[] = {
    {.name = "low_v", .unit = "V", .low = -1e9, .high = 1e9, .text = "least voltage that reaches the actuator"},
    {.name = "high_v", .unit = "V", .low = -1e9, .high = 1e9, .text = "largest voltage that reaches the actuator"}};

typedef struct {
    double low_v, high_v;
} state_t;

static bool check(const parameter_t *parameter, failure_t *failure) {
    return parameter[LOW].value[0] < parameter[HIGH].value[0] ||
           fail(failure, "low_v = %g is not below high_v = %g", parameter[LOW].value[0], parameter[HIGH].value[0]);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    (void)setup;
    *(state_t *)memory = (state_t){parameter[LOW].value[0], parameter[HIGH].value[0]};
}

static void step(void *memory, signal_t *signal) {
    const state_t *state = memory;
    signal->value = fmax(state->low_v, fmin(state->high_v, signal->value));
    signal->turn_v = fmax(state->low_v, fmin(state->high_v, signal->turn_v));
}

/* A rail has no inverse. An amplifier whose drive stays between the rails is not affected. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    hyst_parameters_t *p = job->parameters;
    const hyst_q31_t low = hyst_clamp(drive_from_volts(p, parameter[LOW].value[0]), p->drive_low, p->drive_high);
    const hyst_q31_t high = hyst_clamp(drive_from_volts(p, parameter[HIGH].value[0]), p->drive_low, p->drive_high);
    if (low >= high) {
        return fail(job->failure, "the drive range lies outside the rails at %g and %g V", parameter[LOW].value[0],
                    parameter[HIGH].value[0]);
    }
    p->drive_low = low;
    p->drive_high = high;
    p->drive_park = hyst_clamp(p->drive_park, low, high);
    compile_note(job, "%s: the drive is limited to %.5g to %.5g V", job->block, drive_to_volts(p, p->drive_low),
                 drive_to_volts(p, p->drive_high));
    compile_uncorrected(job, "no drive reaches a position beyond the rails; the drive stops at them");
    return true;
}

/* The high rail inside the drive's range, the low one; and both: a rail outside of the range has no derivative. */
static bool probe_inside(const probe_setting_t *setting, size_t index, double *value) {
    static const double inside[] = {0.02, 0.1};
    const double range = setting->drive_high_v - setting->drive_low_v, by = inside[index / 2 % 2] * range;
    const size_t which = index < 4 ? index % 2 : 2;
    value[LOW] = setting->drive_low_v + (which == 0 ? -range : by);
    value[HIGH] = setting->drive_high_v - (which == 1 ? -range : by);
    return index < 4 || (setting->strong && index == 4);
}

/* A supply that was measured and is too low for the drive comes first: the rail cannot be above it. Whether there is
 * one the position says. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    const double supply_v = setting->short_supply_v;
    const size_t measured = supply_v > 0.0 && supply_v > setting->drive_low_v ? 1 : 0;
    if (index < measured) {
        value[LOW] = 2.0 * setting->drive_low_v - setting->drive_high_v;
        value[HIGH] = supply_v;
        return true;
    }
    return probe_inside(setting, index - measured, value);
}

static bool from_look(const probe_seen_t *seen, size_t index, double *value) {
    value[LOW] = seen->rail_v[0];
    value[HIGH] = seen->rail_v[1];
    return index == 0 && seen->rails;
}

static const probe_t looked_for = {
    .group = "saturation",
    .explanation = "The voltage stops at a rail: flat only at the extremes, as if the drive had not gone on.",
    .excitation = "an amplitude ladder from 80 to 110 % of the range",
    .parts = PROBE_FAST_TRIANGLE | PROBE_LADDER,
    .probe = probe,
    .from_look = from_look,
    .searched = 1U << LOW | 1U << HIGH,
    .accuracy = {0.0005}};

const block_t block_amplifier_saturation = {.name = "amplifier_saturation",
                                            .place = PLACE_ELECTRONICS,
                                            .order = 40,
                                            .text = "rails that the voltage does not leave",
                                            .parameter = parameters,
                                            .parameters = 2,
                                            .check = check,
                                            .state_bytes = sizeof(state_t),
                                            .open = open,
                                            .settle = step,
                                            .step = step,
                                            .compile = compile,
                                            .probe = &looked_for};
