/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_job.h"
#include "elements/play_curve.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* Error that merging may always cause, as a fraction of full scale: a 64th of a step of a 16-bit converter. */
static const double free_merge = 0x1p-22;
/* Distance that two thresholds keep, of full scale: well above the Q31 step. */
static const double closest_thresholds = 0x1p-24;

void compile_note(compile_job_t *job, const char *format, ...) {
    va_list arguments;
    if (job->report->notes < COMPILE_MAX_NOTES) {
        va_start(arguments, format);
        vsnprintf(job->report->note[job->report->notes++], sizeof job->report->note[0], format, arguments);
        va_end(arguments);
    }
}

void compile_uncorrected(compile_job_t *job, const char *format, ...) {
    uncorrected_t *uncorrected = &job->report->uncorrected_block[job->report->uncorrected++]; /* once a block */
    va_list arguments;
    uncorrected->block = job->block;
    va_start(arguments, format);
    vsnprintf(uncorrected->why, sizeof uncorrected->why, format, arguments);
    va_end(arguments);
}

double compile_preload_n(compile_job_t *job) {
    job->preload_taken = true;
    return job->options->preload_n;
}

double compile_frequency_hz(compile_job_t *job) {
    job->frequency_taken = true;
    return job->options->frequency_hz;
}

bool compile_to_fixed(compile_job_t *job, double value, int bits, const char *what, int32_t *fixed) {
    const double scaled = floor(ldexp(value, bits) + 0.5);
    if (!(scaled >= -0x1p31 && scaled < 0x1p31)) {
        return fail(job->failure, "%s = %g does not fit the amplifier's number format (%g to %g)", what, value,
                    -ldexp(1.0, 31 - bits), ldexp(1.0, 31 - bits));
    }
    *fixed = (int32_t)scaled;
    return true;
}

static bool add_filter(compile_job_t *job, inverse_filter_t filter, uint32_t *sections, hyst_iir_section_t *section) {
    job->delay_s += filter.delay_s;
    if (!filter.section) {
        compile_note(job, "%s: no filter, only its delay of %.4g ms is compensated", job->block, 1e3 * filter.delay_s);
        return true;
    }
    if (*sections == HYST_IIR_MAX_SECTIONS) {
        return fail(job->failure, "the amplifier has no more than %d sections a filter", HYST_IIR_MAX_SECTIONS);
    }
    section[(*sections)++] = quantise_section(&filter);
    compile_note(job, "%s: inverted up to a roll-off at %.5g Hz", job->block, filter.rolloff_hz);
    return true;
}

bool compile_equalise(compile_job_t *job, inverse_filter_t filter) {
    return add_filter(job, filter, &job->parameters->equalise_sections, job->parameters->equalise);
}

bool compile_shape(compile_job_t *job, inverse_filter_t filter) {
    return add_filter(job, filter, &job->parameters->shape_sections, job->parameters->shape);
}

bool compile_second_order(compile_job_t *job, const parameter_t *parameter,
                          bool (*put)(compile_job_t *job, inverse_filter_t filter)) {
    inverse_filter_t inverse;
    const second_order_t filter = second_order_make(parameter, job->rate_hz);
    if (!invert_second_order(&filter, job->rate_hz, job->options->no_filters, &inverse)) {
        compile_uncorrected(job, "its inverse is no stable filter, or beyond the amplifier's number format");
        return true;
    }
    return put(job, inverse);
}

static bool add_curve(compile_job_t *job, compile_function_t function, const void *state, const char *what,
                      uint32_t *curves, hyst_curve_t *curve, double *center, double *half) {
    const double low = *center - *half, step = 2.0 * *half / HYST_CURVE_INTERVALS;
    const double from = function(state, low), to = function(state, low + HYST_CURVE_INTERVALS * step);
    if (*curves > 0) {
        return fail(job->failure, "the amplifier has no second %s", what);
    }
    *curves = 1;
    *center = 0.5 * (from + to);
    *half = 0.5 * (to - from);
    for (int i = 0; i < HYST_CURVE_NODES; i++) {
        const double node = (function(state, low + i * step) - *center) / *half;
        if (!compile_to_fixed(job, fmin(node, 1.0 - 0x1p-31), 31, what, &curve->node[i])) {
            return false;
        }
    }
    return true;
}

bool compile_drive_curve(compile_job_t *job, compile_function_t function, const void *state) {
    return add_curve(job, function, state, "drive curve", &job->parameters->drive_curves, job->parameters->drive_curve,
                     &job->drive_center_v, &job->drive_half_v);
}

bool compile_reference_curve(compile_job_t *job, compile_function_t function, const void *state) {
    return add_curve(job, function, state, "reference curve", &job->parameters->reference_curves,
                     job->parameters->reference_curve, &job->elastic_center_um, &job->elastic_half_um);
}

static double weight_sum(const play_bank_t *bank) {
    double sum = 0.0;
    for (size_t i = 0; i <= bank->operators; i++) {
        sum += fabs(bank->weight[i]);
    }
    return sum;
}

static bool round_bank(compile_job_t *job, const play_bank_t *bank, double offset) {
    hyst_parameters_t *p = job->parameters;
    bool good;
    p->pi_operators = (uint32_t)bank->operators;
    good = compile_to_fixed(job, offset, 31, "the position at the middle of the drive range (of the position range)",
                            &p->hysteresis_offset);
    for (size_t i = 0; good && i <= bank->operators; i++) {
        good = compile_to_fixed(job, bank->weight[i], 28, "a weight", &p->pi_weight[i]) &&
               (i == 0 || compile_to_fixed(job, bank->threshold[i - 1], 31, "a threshold", &p->pi_threshold[i - 1]));
    }
    if (good && weight_sum(bank) * HYST_Q28_ONE > (double)HYST_PI_MAX_WEIGHT_SUM) {
        return fail(job->failure,
                    "the weights add up to %.3g position ranges a drive range, the amplifier takes %g: widen "
                    "--position-range, or fit fewer operators",
                    weight_sum(bank), (double)HYST_PI_MAX_WEIGHT_SUM / HYST_Q28_ONE);
    }
    return good;
}

bool compile_play_bank(compile_job_t *job, double offset_um, size_t operators, const double *weight,
                       const double *threshold_v) {
    double offset = offset_um - job->elastic_center_um;
    play_bank_t bank = {.operators = operators,
                        .weight = allocate(operators + 1, sizeof(double)),
                        .threshold = allocate(operators, sizeof(double))};
    bool good;
    /* u = center + half x and z = center + half zeta: a play operator of the one is the play operator of the other. */
    for (size_t i = 0; i <= operators; i++) {
        offset += weight[i] * job->drive_center_v;
        bank.weight[i] = weight[i] * job->drive_half_v / job->elastic_half_um;
    }
    for (size_t i = 0; i < operators; i++) {
        bank.threshold[i] = threshold_v[i] / job->drive_half_v;
    }
    offset /= job->elastic_half_um;
    job->report->model_operators = operators;
    job->report->merge_error_um =
        job->elastic_half_um * play_bank_thin(&bank, HYST_PI_MAX_OPERATORS, 1.0, free_merge, closest_thresholds);
    good = round_bank(job, &bank, offset);
    free(bank.weight);
    free(bank.threshold);
    return good;
}

bool compile_creep(compile_job_t *job, creep_cells_t cells) {
    hyst_parameters_t *p = job->parameters;
    if (p->creep_cells > 0) {
        return fail(job->failure, "the amplifier has one bank of relaxations: creep and dielectric_loss both need it");
    }
    p->creep_cells = (uint32_t)cells.cells;
    compile_note(job, "%s: %zu relaxations are subtracted from the reference, sample by sample", job->block,
                 cells.cells);
    job->elastic_center_um /= creep_gain_at_rest(&cells); /* at rest creep multiplies the position by its gain */
    for (size_t j = 0; j < cells.cells; j++) {
        if (!compile_to_fixed(job, cells.gain, 31, "creep gain", &p->creep[j].gain) ||
            !compile_to_fixed(job, cells.rate[j], 31, "creep rate", &p->creep[j].rate)) {
            return false;
        }
    }
    return true;
}
