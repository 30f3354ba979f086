/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * A force against the motion, from a mount that may be a spring: y = (u - s F) / (1 + s K + c F).
 *
 * An actuator of compliance s (um/N) under the force F + (K + kappa F) y, with c = s kappa: the mount pushes with F at
 * position 0 and is stiffer the harder it was tightened. docs/MODELS.md, section 11.
 */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include <math.h>

enum { COMPLIANCE, FORCE, SHIFT, SPRING };

static const parameter_info_t parameters[] = {
    {.name = "compliance_per_n",
     .proportional = true,
     .unit = "1/N",
     .low = 0.0,
     .high = 1e3,
     .text = "stroke lost per force, as a part of what is left"},
    {.name = "force_n",
     .unit = "N",
     .low = 0.0,
     .high = 1e6,
     .optional = true,
     .default_value = HUGE_VAL,
     .chosen = true,
     .text = "the preload; absent: that of the recording (header key preload_n)"},
    {.name = "shift_um_per_n",
     .unit = "um/N",
     .low = 0.0,
     .high = 1e3,
     .optional = true,
     .chosen = true,
     .text = "compliance of the actuator: position lost per force; 0 where the sensor was set to zero under load"},
    {.name = "spring_n_per_um",
     .unit = "N/um",
     .low = 0.0,
     .high = 1e6,
     .optional = true,
     .chosen = true,
     .text = "stiffness of the mount without preload; acts through shift_um_per_n"}};

typedef struct {
    double gain, shift_um;
} state_t;

static state_t state_under(const parameter_t *parameter, double preload_n) {
    const double force = isfinite(parameter[FORCE].value[0]) ? parameter[FORCE].value[0] : preload_n;
    const double shift = parameter[SHIFT].value[0];
    return (state_t){.gain = 1.0 / (1.0 + shift * parameter[SPRING].value[0] + parameter[COMPLIANCE].value[0] * force),
                     .shift_um = shift * force};
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    *(state_t *)memory = state_under(parameter, setup->preload_n);
}

static void step(void *memory, signal_t *signal) {
    const state_t *state = memory;
    signal->value = state->gain * (signal->value - state->shift_um);
}

/* The hysteresis must deliver the position before the reduction by the force. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const double preload_n = compile_preload_n(job);
    const state_t state = state_under(parameter, preload_n);
    job->elastic_center_um = job->elastic_center_um / state.gain + state.shift_um;
    job->elastic_half_um /= state.gain;
    const bool given = isfinite(parameter[FORCE].value[0]);
    compile_note(job, "%s: compiled for %g N (%s)", job->block, given ? parameter[FORCE].value[0] : preload_n,
                 given ? "the model's" : "--preload");
    return true;
}

static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    value[COMPLIANCE] = 1e-3;
    return setting->preloads && index == 0;
}

static const probe_t looked_for = {.group = "preload",
                                   .explanation = "The stroke gets smaller the harder the actuator is pressed.",
                                   .excitation =
                                       "the same drive under three preloads, each noted in its recording as preload_n",
                                   .parts = PROBE_FAST_TRIANGLE,
                                   .probe = probe,
                                   .absent = "the recordings are all at one preload, or do not say at which",
                                   .searched = 1U << COMPLIANCE,
                                   .accuracy = {0.01}};

const block_t block_preload = {.name = "preload",
                               .place = PLACE_MECHANICS,
                               .order = 30,
                               .text = "a force against the motion that costs stroke",
                               .parameter = parameters,
                               .parameters = 4,
                               .state_bytes = sizeof(state_t),
                               .open = open,
                               .settle = step,
                               .step = step,
                               .compile = compile,
                               .probe = &looked_for};
