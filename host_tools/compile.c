/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile.h"
#include "compile_filters.h"
#include "creep_cells.h"
#include "play_curve.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Merging may cost this part of full scale without being asked for: a 64th of a step of a 16-bit converter. */
static const double free_merge = 0x1p-22;
/* Distance that two thresholds keep, of full scale: well above the Q31 step. */
static const double closest_thresholds = 0x1p-24;
/* The drive returns from a transition over its whole range within this time. */
static const double transition_s = 0.05;
/* A delay is exact to this part of a sample. */
static const double least_fraction = 0.01;

typedef struct {
    const model_t *model;
    const compile_options_t *options;
    hyst_parameters_t *parameters;
    compile_report_t *report;
    failure_t *failure;
    double rate_hz, delay_s;
} job_t;

#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
static void
note(job_t *job, const char *format, ...) {
    va_list arguments;
    if (job->report->notes < COMPILE_MAX_NOTES) {
        va_start(arguments, format);
        vsnprintf(job->report->note[job->report->notes++], sizeof job->report->note[0], format, arguments);
        va_end(arguments);
    }
}

/* value * 2^bits, rounded; refused outside 32 bits. */
static bool to_fixed(job_t *job, double value, int bits, const char *what, int32_t *fixed) {
    const double scaled = floor(ldexp(value, bits) + 0.5);
    if (!(scaled >= -0x1p31 && scaled < 0x1p31)) {
        return fail(job->failure, "%s = %g does not fit the amplifier's number format (%g to %g)", what, value,
                    -ldexp(1.0, 31 - bits), ldexp(1.0, 31 - bits));
    }
    *fixed = (int32_t)scaled;
    return true;
}

static bool set_range(job_t *job, const double given[2], const char *fit_key, const char *option, int32_t *center,
                      int32_t *half_range) {
    double range[2] = {given[0], given[1]};
    if (!(range[0] < range[1])) {
        double margin;
        if (!model_fit_range(job->model, fit_key, range)) {
            return fail(job->failure, "the model does not say its %s: give %s LO:HI", fit_key, option);
        }
        margin = 0.025 * (range[1] - range[0]); /* 5 % in all */
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

static bool set_ranges(job_t *job) {
    hyst_parameters_t *p = job->parameters;
    double recorded[2];
    if (!set_range(job, job->options->drive_range_v, "drive_range_v", "--drive-range", &p->drive_center_uv,
                   &p->drive_half_range_uv) ||
        !set_range(job, job->options->position_range_um, "displacement_range_um", "--position-range",
                   &p->position_center_pm, &p->position_half_range_pm)) {
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

/* Fits a straight line to the major loop (once around it, evenly in the drive) and inverts it. */
static bool set_linear(job_t *job, const play_bank_t *bank, double offset) {
    enum { POINTS = 1000 };
    double *memory = allocate(bank->operators, sizeof(double));
    double sum_y = 0.0, sum_uy = 0.0, sum_uu = 0.0, slope;
    for (size_t i = 0; i < bank->operators; i++) {
        memory[i] = -1.0 + bank->threshold[i];
    }
    for (int k = 0; k < 2 * POINTS; k++) {
        const double u = k < POINTS ? -1.0 + 2.0 * k / POINTS : 3.0 - 2.0 * k / POINTS;
        double y = offset + bank->weight[0] * u;
        for (size_t i = 0; i < bank->operators; i++) {
            memory[i] = fmax(u - bank->threshold[i], fmin(u + bank->threshold[i], memory[i]));
            y += bank->weight[i + 1] * memory[i];
        }
        sum_y += y;
        sum_uy += u * y;
        sum_uu += u * u;
    }
    free(memory);
    slope = sum_uy / sum_uu; /* u has mean 0 */
    if (!(slope > 0.0)) {
        return fail(job->failure, "the hysteresis falls over its whole loop: an amplifier cannot invert it");
    }
    return to_fixed(job, 1.0 / slope, 28, "linear_gain", &job->parameters->linear_gain) &&
           to_fixed(job, -(sum_y / (2.0 * POINTS)) / slope, 31, "linear_offset", &job->parameters->linear_offset);
}

static creep_cells_t cells_of(const model_block_t *block, double rate_hz) {
    return creep_cells(model_parameter(block, "gamma_per_decade")->value[0],
                       model_parameter(block, "shortest_s")->value[0], model_parameter(block, "longest_s")->value[0],
                       rate_hz);
}

static bool set_creep(job_t *job, const model_block_t *block) {
    hyst_parameters_t *p = job->parameters;
    const creep_cells_t cells = cells_of(block, job->rate_hz);
    p->creep_cells = (uint32_t)cells.cells;
    for (size_t j = 0; j < cells.cells; j++) {
        if (!to_fixed(job, cells.gain, 31, "creep gain", &p->creep[j].gain) ||
            !to_fixed(job, cells.rate[j], 31, "creep rate", &p->creep[j].rate)) {
            return fail_in(job->failure, "block %s", block->block->name);
        }
    }
    return true;
}

/* The middle of the position range before creep: at rest creep multiplies it by its gain. */
static double center_before_creep(const job_t *job) {
    const model_block_t *block = model_find(job->model, "creep");
    const double center = 1e-6 * job->parameters->position_center_pm;
    if (block == NULL) {
        return center;
    }
    const creep_cells_t cells = cells_of(block, job->rate_hz);
    return center / creep_gain_at_rest(&cells);
}

static double weight_sum(const play_bank_t *bank) {
    double sum = 0.0;
    for (size_t i = 0; i <= bank->operators; i++) {
        sum += fabs(bank->weight[i]);
    }
    return sum;
}

static bool set_hysteresis(job_t *job, const model_block_t *block) {
    hyst_parameters_t *p = job->parameters;
    const parameter_t *weights = model_parameter(block, "weights"),
                      *thresholds = model_parameter(block, "thresholds_v");
    const double drive_center = 1e-6 * p->drive_center_uv, drive_half = 1e-6 * p->drive_half_range_uv;
    const double position_half = 1e-6 * p->position_half_range_pm;
    double offset = model_parameter(block, "offset_um")->value[0] - center_before_creep(job);
    play_bank_t bank = {.operators = thresholds->count,
                        .weight = allocate(weights->count, sizeof(double)),
                        .threshold = allocate(thresholds->count, sizeof(double))};
    bool good;
    /* u = center + half x and z = center + half zeta: a play operator of the one is the play operator of the other. */
    for (size_t i = 0; i < weights->count; i++) {
        offset += weights->value[i] * drive_center;
        bank.weight[i] = weights->value[i] * drive_half / position_half;
    }
    for (size_t i = 0; i < thresholds->count; i++) {
        bank.threshold[i] = thresholds->value[i] / drive_half;
    }
    offset /= position_half;
    job->report->model_operators = bank.operators;
    job->report->merge_error_um =
        position_half * play_bank_thin(&bank, HYST_PI_MAX_OPERATORS, 1.0, free_merge, closest_thresholds);
    p->pi_operators = (uint32_t)bank.operators;
    good = to_fixed(job, offset, 31, "the position at the middle of the drive range (of the position range)",
                    &p->pi_offset);
    for (size_t i = 0; good && i <= bank.operators; i++) {
        good = to_fixed(job, bank.weight[i], 28, "a weight", &p->pi_weight[i]) &&
               (i == 0 || to_fixed(job, bank.threshold[i - 1], 31, "a threshold", &p->pi_threshold[i - 1]));
    }
    if (good && weight_sum(&bank) * HYST_Q28_ONE > (double)HYST_PI_MAX_WEIGHT_SUM) {
        good = fail(job->failure,
                    "the weights add up to %.3g position ranges a drive range, the amplifier takes %g: widen "
                    "--position-range, or fit fewer operators",
                    weight_sum(&bank), (double)HYST_PI_MAX_WEIGHT_SUM / HYST_Q28_ONE);
    }
    good = good && set_linear(job, &bank, offset);
    free(bank.weight);
    free(bank.threshold);
    return good || fail_in(job->failure, "block %s", block->block->name);
}

/* The hysteresis is set before this. */
static bool set_rate_dependence(job_t *job, const model_block_t *block) {
    hyst_parameters_t *p = job->parameters;
    const double filter_s = model_parameter(block, "rate_filter_s")->value[0];
    const double gain = filter_s > 0.0 ? -expm1(-1.0 / (filter_s * job->rate_hz)) : 1.0;
    const double largest = p->pi_operators > 0 ? (double)p->pi_threshold[p->pi_operators - 1] * 0x1p-31 : 0.0;
    job->report->growth_limit_v = (1.0 - largest) * 1e-6 * p->drive_half_range_uv;
    return (to_fixed(job, model_parameter(block, "beta_s")->value[0] * job->rate_hz, 20, "beta in samples",
                     &p->pi_beta) &&
            to_fixed(job, gain, 30, "rate gain", &p->pi_rate_gain)) ||
           fail_in(job->failure, "block %s", block->block->name);
}

static bool add_filter(job_t *job, const model_block_t *block, inverse_filter_t filter, uint32_t *sections,
                       hyst_iir_section_t *section) {
    job->delay_s += filter.delay_s;
    if (!filter.section) {
        note(job, "%s: no filter, only its delay of %.4g ms is compensated", block->block->name, 1e3 * filter.delay_s);
        return true;
    }
    if (*sections == HYST_IIR_MAX_SECTIONS) {
        return fail(job->failure, "block %s: the amplifier has no more than %d sections a filter", block->block->name,
                    HYST_IIR_MAX_SECTIONS);
    }
    section[(*sections)++] = quantise_section(&filter);
    note(job, "%s: inverted up to a roll-off at %.5g Hz", block->block->name, filter.rolloff_hz);
    return true;
}

static bool compile_block(job_t *job, const model_block_t *block) {
    hyst_parameters_t *p = job->parameters;
    const char *name = block->block->name;
    const bool no_filters = job->options->no_filters;
    if (strcmp(name, "transport_delay") == 0) {
        job->delay_s += model_parameter(block, "delay_s")->value[0];
        return true;
    }
    if (strcmp(name, "amplifier_bandwidth") == 0) {
        return add_filter(job, block,
                          invert_lag(model_parameter(block, "cutoff_hz")->value[0], job->rate_hz, no_filters),
                          &p->equalise_sections, p->equalise);
    }
    if (strcmp(name, "prandtl_ishlinskii") == 0) {
        return set_hysteresis(job, block);
    }
    if (strcmp(name, "rate_dependent_hysteresis") == 0) {
        return true; /* needs the thresholds: set_rate_dependence, later */
    }
    if (strcmp(name, "creep") == 0) {
        return set_creep(job, block);
    }
    if (strcmp(name, "resonance") == 0) {
        return add_filter(job, block,
                          invert_mode(model_parameter(block, "frequency_hz")->value[0],
                                      model_parameter(block, "damping_ratio")->value[0], job->rate_hz, no_filters),
                          &p->shape_sections, p->shape);
    }
    if (strcmp(name, "sensor_bandwidth") == 0) {
        return add_filter(job, block,
                          invert_lag(model_parameter(block, "cutoff_hz")->value[0], job->rate_hz, no_filters),
                          &p->shape_sections, p->shape);
    }
    if (strcmp(name, "sensor_noise") == 0 || strcmp(name, "quantisation") == 0) {
        note(job, "%s: cannot be compensated, left out", name);
        return true;
    }
    return fail(job->failure, "block %s: this amplifier has no inverse for it", name);
}

/*
 * Whole samples of delay are looked ahead over. What the last of them is too much becomes a delay by linear
 * interpolation, a shape section with b0 = 1 - f and b1 = f: the right phase at low frequencies, and a gain that falls
 * to cos(pi * frequency / rate) for f = 1/2, by less otherwise.
 */
static bool set_lookahead(job_t *job) {
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
    note(job, "delay: looks %u samples ahead and waits %.4g us in a shape section", (unsigned)whole,
         1e6 * fraction / job->rate_hz);
    return true;
}

/* So that an amplifier can tell which model it runs. */
static uint32_t model_identity(const model_t *model) {
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

static bool compile_chain(job_t *job) {
    hyst_parameters_t *p = job->parameters;
    const model_block_t *rate_dependence = model_find(job->model, "rate_dependent_hysteresis");
    const double rate_mhz = floor(1e3 * job->rate_hz + 0.5);
    if (!(rate_mhz >= 1.0 && rate_mhz < 0x1p32)) {
        return fail(job->failure, "a sample rate of %g Hz is beyond what an image can carry", job->rate_hz);
    }
    p->sample_rate_mhz = (uint32_t)rate_mhz;
    p->model_id = model_identity(job->model);
    p->pi_rate_gain = HYST_Q30_ONE;
    p->transition_slew =
        hyst_clamp((int32_t)fmin(0x1p31 - 1.0, 0x1p32 / (transition_s * job->rate_hz)), 1, HYST_Q31_MAX);
    if (!set_ranges(job)) {
        return false;
    }
    for (size_t i = 0; i < job->model->blocks; i++) {
        if (!compile_block(job, &job->model->block[i])) {
            return false;
        }
    }
    return (rate_dependence == NULL || set_rate_dependence(job, rate_dependence)) && set_lookahead(job);
}

bool compile_model(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                   compile_report_t *report, failure_t *failure) {
    compile_report_t unread;
    job_t job = {.model = model,
                 .options = options,
                 .parameters = parameters,
                 .report = report != NULL ? report : &unread,
                 .failure = failure,
                 .rate_hz = options->sample_rate_hz > 0.0 ? options->sample_rate_hz : model->sample_rate_hz};
    memset(parameters, 0, sizeof *parameters);
    memset(job.report, 0, sizeof *job.report);
    return model_check(model, "model", failure) && compile_chain(&job) &&
           parameters_check(parameters, "compiled image", failure);
}

bool compile_scales(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                    failure_t *failure) {
    job_t job = {.model = model, .options = options, .parameters = parameters, .failure = failure};
    return set_ranges(&job);
}
