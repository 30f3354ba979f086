/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile.h"
#include "chain/chain.h"
#include "chain/fit_ranges.h"
#include "compile/compile_job.h"
#include "hyst/cost.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The drive returns from a transition over its whole range within this time. */
static const double transition_s = 0.05;
/* A delay is exact to this part of a sample. */
static const double least_fraction = 0.01;

static bool set_range(compile_job_t *job, const double given[2], const char *converter_key, const char *fit_key,
                      const char *option, int32_t *center, int32_t *half_range) {
    double range[2] = {given[0], given[1]};
    if (!(range[0] < range[1]) && !model_fit_range(job->model, converter_key, range)) {
        if (!model_fit_range(job->model, fit_key, range)) {
            return fail(job->failure, "the model does not say its %s: give %s LO:HI", fit_key, option);
        }
        const double margin = MODEL_RANGE_MARGIN * (range[1] - range[0]);
        range[0] -= margin;
        range[1] += margin;
    }
    const double micro_center = floor(0.5e6 * (range[0] + range[1]) + 0.5);
    const double micro_half = floor(0.5e6 * (range[1] - range[0]) + 0.5);
    if (!(fabs(micro_center) < 0x1p31 && micro_half >= 1.0 && micro_half < 0x1p31)) {
        return fail(job->failure, "%s %g:%g is beyond what an image can carry (2147 V or um)", option, range[0],
                    range[1]);
    }
    *center = (int32_t)micro_center;
    *half_range = (int32_t)micro_half;
    return true;
}

static bool set_ranges(compile_job_t *job) {
    hyst_parameters_t *p = job->parameters;
    double recorded[2];
    if (!set_range(job, job->options->drive_range_v, DRIVE_CONVERTER_KEY, "drive_range_v", "--drive-range",
                   &p->drive_center_uv, &p->drive_half_range_uv) ||
        !set_range(job, job->options->position_range_um, POSITION_CONVERTER_KEY, "displacement_range_um",
                   "--position-range", &p->position_center_pm, &p->position_half_range_pm)) {
        return false;
    }
    p->drive_low = HYST_Q31_MIN;
    p->drive_high = HYST_Q31_MAX;
    if (model_fit_range(job->model, "drive_range_v", recorded)) { /* nothing is known outside what was recorded */
        p->drive_low = drive_from_volts(p, recorded[0]);
        p->drive_high = drive_from_volts(p, recorded[1]);
    }
    if (p->drive_low >= p->drive_high) {
        return fail(job->failure, "--drive-range does not touch the recorded drive range %g:%g V", recorded[0],
                    recorded[1]);
    }
    p->drive_park = hyst_clamp(drive_from_volts(p, 0.0), p->drive_low, p->drive_high);
    return true;
}

/* So slow that masses, damping and thresholds that grow with the rate count for nothing, unless the model holds at one
 * sample rate. */
static double slow_rate_hz(const model_t *hysteresis, double rate_hz) {
    const double slower = 1e-9;
    for (size_t i = 0; i < hysteresis->blocks; i++) {
        const model_block_t *block = &hysteresis->block[i];
        if (block->block->one_sample_rate != NULL && block->block->one_sample_rate(block->parameter)) {
            return rate_hz;
        }
    }
    return slower * rate_hz;
}

/*
 * Fits a straight line to the major loop of the hysteresis and what modifies it, slowly once around after a first loop
 * that settles it, evenly in the drive, and inverts it.
 */
static bool set_linear(compile_job_t *job) {
    enum { POINTS = 2000 };
    const hyst_parameters_t *p = job->parameters;
    double sum_y = 0.0, sum_uy = 0.0, sum_uu = 0.0, slope;
    model_t model;
    chain_t *chain;
    model_copy_place(&model, job->model, PLACE_HYSTERESIS);
    chain = chain_open(&model, slow_rate_hz(&model, job->rate_hz), 0, job->failure);
    model_free(&model);
    if (chain == NULL) {
        return false;
    }
    chain_settle(chain, drive_to_volts(p, HYST_Q31_MIN));
    for (int k = 0; k < 2 * POINTS; k++) {
        const double u = 1.0 - 2.0 * fabs(1.0 - 2.0 * (double)(k % POINTS) / POINTS);
        const double position = chain_step(chain, 1e-6 * (p->drive_center_uv + p->drive_half_range_uv * u));
        const double y = reference_for(p, (position - job->elastic_center_um) / job->elastic_half_um);
        if (k >= POINTS) {
            sum_y += y;
            sum_uy += u * y;
            sum_uu += u * u;
        }
    }
    chain_close(chain);
    slope = sum_uy / sum_uu; /* u has mean 0 */
    if (!(slope > 0.0)) {
        return fail(job->failure, "the hysteresis falls over its whole loop: an amplifier cannot invert it");
    }
    return (compile_to_fixed(job, 1.0 / slope, 28, "linear_gain", &job->parameters->linear_gain) &&
            compile_to_fixed(job, -(sum_y / POINTS) / slope, 31, "linear_offset", &job->parameters->linear_offset)) ||
           fail_in(job->failure, "the straight line of the mode linear, from --position-range to --drive-range");
}

static bool compile_block(compile_job_t *job, const model_block_t *block) {
    const block_t *kind = block->block;
    job->block = kind->name;
    if (kind->compile == NULL) {
        compile_uncorrected(job, "%s", kind->uncorrected);
        return true;
    }
    return kind->compile(job, block->parameter) || fail_in(job->failure, "block %s", kind->name);
}

/* The hysteresis comes last: the other blocks first determine its range of positions and of drives. */
static bool compile_blocks(compile_job_t *job) {
    for (int last = 0; last < 2; last++) {
        for (size_t i = job->model->blocks; i-- > 0;) {
            const block_t *block = job->model->block[i].block;
            const bool hysteresis = block->place == PLACE_HYSTERESIS && !block->modifies_hysteresis;
            if (hysteresis == (last != 0) && !compile_block(job, &job->model->block[i])) {
                return false;
            }
        }
    }
    return set_linear(job);
}

/* The amplifier's thresholds grow to full scale at most. */
static double growth_limit_v(const compile_job_t *job) {
    const hyst_parameters_t *p = job->parameters;
    const double largest = p->pi_operators > 0 ? (double)p->pi_threshold[p->pi_operators - 1] * 0x1p-31 : 0.0;
    return p->pi_beta > 0 ? (1.0 - largest) * job->drive_half_v : 0.0;
}

/*
 * The lookahead covers the delay rounded up to whole samples. The excess becomes a delay by linear interpolation, a
 * shape section with b0 = 1 - f and b1 = f. Its phase is right at low frequencies; its gain falls to cos(pi * frequency
 * / rate) for f = 1/2, and by less otherwise.
 */
static bool set_lookahead(compile_job_t *job) {
    hyst_parameters_t *p = job->parameters;
    const bool interpolate = !job->options->no_filters && p->shape_sections < HYST_IIR_MAX_SECTIONS;
    const double delay_s = job->delay_s + job->options->delay_s, samples = delay_s * job->rate_hz;
    const double whole = fmax(0.0, interpolate ? ceil(samples - least_fraction) : floor(samples + 0.5));
    const double fraction = whole - samples;
    if (whole > HYST_LOOKAHEAD_MAX) {
        return fail(job->failure, "a delay of %.4g s is %.0f samples, the amplifier looks ahead at most %u", delay_s,
                    whole, HYST_LOOKAHEAD_MAX);
    }
    if (fraction > 1.0) {
        return fail(job->failure, "a delay of %.4g s: the amplifier can wait for one sample at most, %.4g s", delay_s,
                    1.0 / job->rate_hz);
    }
    p->lookahead_samples = (uint32_t)whole;
    if (!interpolate || fraction < least_fraction) {
        job->report->lookahead_remainder_s = (samples - whole) / job->rate_hz;
        return true;
    }
    const inverse_filter_t wait = {.section = true, .b1 = fraction};
    p->shape[p->shape_sections++] = quantise_section(&wait);
    compile_note(job, "delay: looks %u samples ahead and waits %.4g us in a shape section", (unsigned)whole,
                 1e6 * fraction / job->rate_hz);
    return true;
}

uint32_t compile_model_id(const model_t *model) {
    json_t *json = model_to_json(model);
    char *text = json_dumps(json, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    const size_t length = strlen(text), words = (length + 3) / 4;
    uint32_t *packed = allocate(words, sizeof(uint32_t)), identity;
    for (size_t i = 0; i < length; i++) {
        packed[i / 4] |= (uint32_t)(unsigned char)text[i] << (8 * (i % 4));
    }
    identity = hyst_crc32(packed, words);
    free(packed);
    free(text);
    json_decref(json);
    return identity;
}

static bool compile_chain(compile_job_t *job) {
    hyst_parameters_t *p = job->parameters;
    const double rate_mhz = floor(1e3 * job->rate_hz + 0.5);
    if (!(rate_mhz >= 1.0 && rate_mhz < 0x1p32)) {
        return fail(job->failure, "a sample rate of %g Hz is beyond what an image can carry", job->rate_hz);
    }
    p->sample_rate_mhz = (uint32_t)rate_mhz;
    p->model_id = compile_model_id(job->model);
    p->pi_rate_gain = HYST_Q30_ONE;
    p->transition_slew =
        hyst_clamp((int32_t)fmin(0x1p31 - 1.0, 0x1p32 / (transition_s * job->rate_hz)), 1, HYST_Q31_MAX);
    if (!set_ranges(job)) {
        return false;
    }
    job->drive_center_v = 1e-6 * p->drive_center_uv;
    job->drive_half_v = 1e-6 * p->drive_half_range_uv;
    job->elastic_center_um = 1e-6 * p->position_center_pm;
    job->elastic_half_um = 1e-6 * p->position_half_range_pm;
    if (!compile_blocks(job)) {
        return false;
    }
    job->report->growth_limit_v = growth_limit_v(job);
    return set_lookahead(job);
}

/* What is given for a block that is not there was meant for another model. */
static bool check_taken(const compile_job_t *job) {
    const compile_options_t *o = job->options;
    if (!(o->preload_n >= 0.0 && o->frequency_hz >= 0.0)) {
        return fail(job->failure, "--preload %g, --frequency %g: negative", o->preload_n, o->frequency_hz);
    }
    if (o->preload_n > 0.0 && !job->preload_taken) {
        return fail(job->failure, "--preload %g: the model has no block preload", o->preload_n);
    }
    if (o->frequency_hz > 0.0 && !job->frequency_taken) {
        return fail(job->failure,
                    "--frequency %g: the model has no block ellipse, and is not inverted for one frequency",
                    o->frequency_hz);
    }
    return true;
}

/* The image is good all the same: a board may have a faster processor. */
static void note_cost(compile_job_t *job) {
    const uint32_t cost = hyst_cost_cycles(job->parameters);
    const uint32_t budget = hyst_cost_budget(HYST_COST_CORE_HZ, job->parameters->sample_rate_mhz);
    if (cost > budget) {
        compile_note(
            job, "an amplifier at %g MHz refuses this: a sample takes up to %u cycles, a period at %.6g Hz has %u",
            1e-6 * HYST_COST_CORE_HZ, (unsigned)cost, 1e-3 * job->parameters->sample_rate_mhz, (unsigned)budget);
    }
}

bool compile_model(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                   compile_report_t *report, failure_t *failure) {
    compile_report_t unread;
    compile_job_t job = {.model = model,
                         .options = options,
                         .parameters = parameters,
                         .report = report != NULL ? report : &unread,
                         .failure = failure,
                         .rate_hz = options->sample_rate_hz > 0.0 ? options->sample_rate_hz : model->sample_rate_hz};
    memset(parameters, 0, sizeof *parameters);
    memset(job.report, 0, sizeof *job.report);
    if (!model_check(model, "model", failure) || !compile_chain(&job) || !check_taken(&job) ||
        !parameters_check(parameters, "compiled image", failure)) {
        return false;
    }
    note_cost(&job);
    return true;
}

bool compile_scales(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                    failure_t *failure) {
    compile_job_t job = {.model = model, .options = options, .parameters = parameters, .failure = failure};
    return set_ranges(&job);
}
