/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The thesis on a P-753.31C: Prandtl-Ishlinskii model with a density, and Preisach model, one set of numbers a
 * frequency. */
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "command_line/print.h"
#include "identify/fit.h"
#include "reproduction.h"
#include "seed_002_chain.h"
#include "seed_002_loops.h"
#include "seed_002_memory.h"
#include "seed_002_track.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Table 3.1 and section 3.2: over 0 to 70 V, at every frequency. */
typedef struct {
    const char *frequency;
    double hz, rate_hz; /* the sample rate is not reported */
    double slope, intercept, maximum, mean, residual_um;
} reported_loop_t;

static const reported_loop_t reported_loops[] = {{"0.1 Hz", 0.1, 100.0, 0.30, 0.58, 7.16, 2.91, (double)NAN},
                                                 {"1 Hz", 1.0, 1000.0, 0.29, 0.81, 7.45, 3.04, (double)NAN},
                                                 {"10 Hz", 10.0, 10000.0, 0.28, 1.1, 9.53, 3.54, 0.4899},
                                                 {"100 Hz", 100.0, 20000.0, 0.26, 1.6, 18.44, 9.77, 1.1164}};

/* Table 5.2, and Table 4.1 as printed. Errors in % of the stroke. */
typedef struct {
    const char *name; /* of frequency and drive */
    double hz, rate_hz, top_v;
    double density_maximum, density_mean, preisach_maximum, preisach_mean;
    double alpha, beta, a, b, delta;
} reported_model_t;

static const reported_model_t reported_models[] = {
    {"0.1 Hz, 0 to 40 V", 0.1, 100.0, 40.0, 4.92, 0.89, 4.71, 0.86, 5.79, 0.000081, 4.38, 0.133, 4.0},
    {"10 Hz, 0 to 70 V", 10.0, 10000.0, 70.0, 4.40, 1.30, 1.84, 0.38, 5.65, 0.000001, 4.60, 0.163, 7.0},
    {"100 Hz, 0 to 70 V", 100.0, 20000.0, 70.0, 21.60, 10.26, 2.61, 0.57, 5.16, 0.000009, 2.87, 0.411, 9.1}};

enum { MODELS = sizeof reported_models / sizeof reported_models[0] };

static void row(reproduction_t *reproduction, const char *what, const char *where, double paper, double ours,
                const char *unit, met_t met, double tolerance) {
    char quantity[200];
    snprintf(quantity, sizeof quantity, "%s, %s", what, where);
    reproduction_row(reproduction, quantity, paper, ours, unit, met, tolerance);
}

/* How well the twin stands for the actuator: eight tuned numbers, eighteen reported ones. Of the tolerances the first
 * is what the slopes are printed to; the others are 1.2 % of the stroke. */
static void compare_twin(reproduction_t *reproduction) {
    static const double slope_tolerance = 0.005, position_tolerance_um = 0.25, percent_tolerance = 1.2;
    for (size_t i = 0; i < sizeof reported_loops / sizeof reported_loops[0]; i++) {
        const reported_loop_t *reported = &reported_loops[i];
        recording_t recording = record_sine_002(reported->hz, reported->rate_hz, 70.0, 10 + i);
        const size_t period = recording.samples / LOOPS_002_CYCLES;
        const double *displacement = recording.column[COLUMN_DISPLACEMENT];
        const line_002_t line = straight_line_002(recording.column[COLUMN_DRIVE], displacement, period);
        char where[100];
        snprintf(where, sizeof where, "0 to 70 V, %s", reported->frequency);
        row(reproduction, "twin: slope of the nominal line", where, reported->slope, line.slope, "um/V", MET_EQUAL,
            slope_tolerance);
        row(reproduction, "twin: nominal line at 0 V", where, reported->intercept, line.intercept, "um", MET_EQUAL,
            position_tolerance_um);
        row(reproduction, "twin: largest nonlinearity", where, reported->maximum, line.maximum, "%", MET_EQUAL,
            percent_tolerance);
        row(reproduction, "twin: mean nonlinearity", where, reported->mean, line.mean, "%", MET_EQUAL,
            percent_tolerance);
        if (isfinite(reported->residual_um)) {
            row(reproduction, "twin: residual displacement", where, reported->residual_um, displacement[period], "um",
                MET_EQUAL, position_tolerance_um);
        }
        recording_free(&recording);
    }
}

/* Of the held-out third, in % of its stroke. */
typedef struct {
    double maximum, mean;
} error_t;

static bool judge(const model_t *model, const recording_t *recording, double *simulated, error_t *error,
                  failure_t *failure) {
    const size_t from = recording->samples * 2 / 3, samples = recording->samples - from;
    const double *measured = recording->column[COLUMN_DISPLACEMENT];
    *error = (error_t){0};
    if (!chain_simulate(model, recording, 1, simulated, failure)) {
        return false;
    }
    const double percent = 100.0 / stroke_002(measured + from, samples);
    for (size_t k = from; k < recording->samples; k++) {
        const double deviation = percent * fabs(measured[k] - simulated[k]);
        error->maximum = fmax(error->maximum, deviation);
        error->mean += deviation / (double)samples;
    }
    return true;
}

static bool fit_and_judge(const family_t *family, const recording_t *recording, double *simulated, model_t *model,
                          error_t *error, failure_t *failure) {
    const fit_options_t options = {0};
    fit_report_t report;
    if (!fit_recordings(family, recording, 1, &options, model, &report, failure)) {
        return false;
    }
    fit_report_free(&report);
    if (!judge(model, recording, simulated, error, failure)) {
        model_free(model);
        return false;
    }
    return true;
}

/* The model of Table 4.1 as printed: a sum of positive stops, on levels of 1 V. */
static void make_printed_model(const reported_model_t *reported, model_t *model) {
    double level_v[100];
    const size_t levels = (size_t)reported->top_v;
    for (size_t j = 0; j < levels; j++) {
        level_v[j] = (double)(j + 1);
    }
    model_create(model, reported->rate_hz);
    model_block_t *block = model_append(model, &block_stop_density);
    model_set(block, "alpha_um_per_v2", -reported->alpha);
    model_set(block, "beta_per_v2", reported->beta);
    model_set(block, "delta_v", reported->delta);
    model_set(block, "a", reported->a);
    model_set(block, "b_v", reported->b);
    model_set_array(block, "levels_v", levels, level_v, NULL);
}

/* A line of the table of what the printed numbers do. */
static bool describe_printed(reproduction_t *reproduction, const reported_model_t *reported,
                             const recording_t *recording, double *simulated, failure_t *failure) {
    const size_t period = recording->samples / LOOPS_002_CYCLES, last = recording->samples - period;
    const double *drive = recording->column[COLUMN_DRIVE] + last;
    const double *measured = recording->column[COLUMN_DISPLACEMENT] + last;
    model_t model;
    make_printed_model(reported, &model);
    const bool good = chain_simulate(&model, recording, 1, simulated, failure);
    model_free(&model);
    if (!good) {
        return false;
    }
    /* Best factor and offset: the deviation of the displacement from a straight line over the model's output. */
    const line_002_t line = straight_line_002(drive, measured, period);
    const line_002_t scaled = straight_line_002(simulated + last, measured, period);
    reproduction_text(
        reproduction,
        "* %s: %.0f %% of the stops have thresholds above half the drive and never slip. The sum rises by %.0f um/V, "
        "the twin by %.2f; its loop turns %s, the twin's %s. Mean error with the best factor and offset %.2f %%, of "
        "a straight line %.2f %%; printed: %.2f %%.",
        reported->name, 100.0 * (1.0 - (0.5 * reported->top_v - reported->b) / (reported->a * reported->top_v)),
        line.slope / scaled.slope, line.slope, direction_002(drive, simulated + last, period),
        direction_002(drive, measured, period), scaled.mean, line.mean, reported->density_mean);
    return true;
}

/* One frequency: its recordings, the models fitted to them and what these make of the sine. */
typedef struct {
    const reported_model_t *reported;
    recording_t sine, reversals;
    double *printed_um, *density_um, *bank_um, *preisach_um, *reversals_um;
    model_t density, bank, preisach; /* of the sine */
    model_t reversals_preisach;      /* of the reversals */
    error_t density_error, bank_error, preisach_error, reversals_error;
} frequency_t;

static void close_frequency(frequency_t *f) {
    model_free(&f->density);
    model_free(&f->bank);
    model_free(&f->preisach);
    model_free(&f->reversals_preisach);
    recording_free(&f->sine);
    recording_free(&f->reversals);
    free(f->printed_um);
    free(f->density_um);
    free(f->bank_um);
    free(f->preisach_um);
    free(f->reversals_um);
}

static bool fit_frequency(frequency_t *f, size_t number, failure_t *failure) {
    const reported_model_t *reported = f->reported = &reported_models[number];
    f->sine = record_sine_002(reported->hz, reported->rate_hz, reported->top_v, 20 + number);
    f->reversals = record_reversals_002(reported->hz, reported->rate_hz, reported->top_v, 30 + number);
    f->printed_um = allocate(f->sine.samples, sizeof(double));
    f->density_um = allocate(f->sine.samples, sizeof(double));
    f->bank_um = allocate(f->sine.samples, sizeof(double));
    f->preisach_um = allocate(f->sine.samples, sizeof(double));
    f->reversals_um = allocate(f->reversals.samples, sizeof(double));
    return fit_and_judge(&family_stop_density, &f->sine, f->density_um, &f->density, &f->density_error, failure) &&
           fit_and_judge(&family_prandtl_ishlinskii, &f->sine, f->bank_um, &f->bank, &f->bank_error, failure) &&
           fit_and_judge(&family_preisach, &f->sine, f->preisach_um, &f->preisach, &f->preisach_error, failure) &&
           fit_and_judge(&family_preisach, &f->reversals, f->reversals_um, &f->reversals_preisach, &f->reversals_error,
                         failure);
}

static void compare_errors(reproduction_t *reproduction, const frequency_t *f) {
    const reported_model_t *reported = f->reported;
    row(reproduction, "density model: mean error", reported->name, reported->density_mean, f->density_error.mean, "%",
        MET_AT_MOST, 0.0);
    row(reproduction, "density model: largest error", reported->name, reported->density_maximum,
        f->density_error.maximum, "%", MET_AT_MOST, 0.0);
    row(reproduction, "Preisach model: mean error", reported->name, reported->preisach_mean, f->preisach_error.mean,
        "%", MET_AT_MOST, 0.0);
    row(reproduction, "Preisach model: largest error", reported->name, reported->preisach_maximum,
        f->preisach_error.maximum, "%", MET_AT_MOST, 0.0);
}

static void describe_density(reproduction_t *reproduction, const frequency_t *f) {
    const model_block_t *block = &f->density.block[0];
    reproduction_text(
        reproduction,
        "* %s: alpha = %.4g um/V², beta = %.3g /V², delta = %.3g V, a = %.3g, b = %.3g V, gain %.4g um/V. A bank of "
        "plays with free weights is left with %.2f %% mean and %.2f %% largest error.",
        f->reported->name, model_parameter(block, "alpha_um_per_v2")->value[0],
        model_parameter(block, "beta_per_v2")->value[0], model_parameter(block, "delta_v")->value[0],
        model_parameter(block, "a")->value[0], model_parameter(block, "b_v")->value[0],
        model_parameter(block, "gain_um_per_v")->value[0], f->bank_error.mean, f->bank_error.maximum);
}

/* How far models of one loop get inside of it. */
static bool describe_reversals(reproduction_t *reproduction, const frequency_t *f, failure_t *failure) {
    double *simulated = allocate(f->reversals.samples, sizeof(double));
    error_t density, preisach;
    const bool good = judge(&f->density, &f->reversals, simulated, &density, failure) &&
                      judge(&f->preisach, &f->reversals, simulated, &preisach, failure);
    free(simulated);
    if (good) {
        reproduction_text(
            reproduction,
            "* %s: density model %.2f %% mean, %.2f %% largest; Preisach model of the one loop %.2f, %.2f; of the "
            "reversal curves %.2f, %.2f.",
            f->reported->name, density.mean, density.maximum, preisach.mean, preisach.maximum, f->reversals_error.mean,
            f->reversals_error.maximum);
    }
    return good;
}

static bool compare_models(reproduction_t *reproduction, frequency_t *frequency, failure_t *failure) {
    for (size_t i = 0; i < MODELS; i++) {
        if (!fit_frequency(&frequency[i], i, failure)) {
            return false;
        }
        compare_errors(reproduction, &frequency[i]);
    }
    reproduction_text(
        reproduction,
        "**Density model.** Printed is y = sum of p(r) E_r[v] dr, p(r) = alpha exp(-beta (r - delta)²), r = a v + b. "
        "A sum of stops of the drive with positive weights turns clockwise; a piezo turns counterclockwise. What "
        "describes it is y = offset + gain v - sum of p(r) E_r[v] dr. And a > 1 puts the threshold of a level above "
        "the level: a stop whose threshold is that of the present drive never slips, and the sum is a straight line. "
        "With thresholds on a grid of levels (1 V here), which is how the model can be meant, the numbers of Table "
        "4.1 do this (and the printed error at 100 Hz, 10.26 %%, is no better than that of the straight line of "
        "Table 3.1, 9.77 %%):");
    for (size_t i = 0; i < MODELS; i++) {
        if (!describe_printed(reproduction, frequency[i].reported, &frequency[i].sine, frequency[i].printed_um,
                              failure)) {
            return false;
        }
    }
    reproduction_text(reproduction, "The density model as it was found here:");
    for (size_t i = 0; i < MODELS; i++) {
        describe_density(reproduction, &frequency[i]);
    }
    reproduction_text(
        reproduction,
        "**Preisach model.** The rows above are for the thesis' work: one loop, fitted and judged. Whoever drives it "
        "otherwise has use for more. On first-order reversal curves (from 0 V up to 14 peaks and down, the last "
        "third held out):");
    for (size_t i = 0; i < MODELS; i++) {
        if (!describe_reversals(reproduction, &frequency[i], failure)) {
            return false;
        }
    }
    return true;
}

/* Loops above, errors below, of the last period. */
static void draw(reproduction_t *reproduction, const frequency_t *frequency) {
    plot_t plot[2 * MODELS];
    plot_line_t line[2 * MODELS][3];
    char title[MODELS][50];
    double *error_um[MODELS][2], *phase[MODELS];
    for (size_t i = 0; i < MODELS; i++) {
        const frequency_t *f = &frequency[i];
        const size_t period = f->sine.samples / LOOPS_002_CYCLES, last = f->sine.samples - period;
        const double *drive = f->sine.column[COLUMN_DRIVE] + last;
        const double *measured = f->sine.column[COLUMN_DISPLACEMENT] + last;
        const double percent = 100.0 / stroke_002(measured, period);
        phase[i] = allocate(period, sizeof(double));
        error_um[i][0] = allocate(period, sizeof(double));
        error_um[i][1] = allocate(period, sizeof(double));
        for (size_t k = 0; k < period; k++) {
            phase[i][k] = (double)k / (double)period;
            error_um[i][0][k] = percent * (f->density_um[last + k] - measured[k]);
            error_um[i][1][k] = percent * (f->preisach_um[last + k] - measured[k]);
        }
        snprintf(title[i], sizeof title[i], "%s", f->reported->name);
        line[i][0] = (plot_line_t){"plain under", "twin", drive, measured, period};
        line[i][1] = (plot_line_t){"before", "density model", drive, f->density_um + last, period};
        line[i][2] = (plot_line_t){"after", "Preisach model", drive, f->preisach_um + last, period};
        line[MODELS + i][0] = (plot_line_t){"before", "density model", phase[i], error_um[i][0], period};
        line[MODELS + i][1] = (plot_line_t){"after", "Preisach model", phase[i], error_um[i][1], period};
        plot[i] = (plot_t){title[i], "drive, V", "displacement, um", line[i], 3, PLOT_NO_SHADE};
        plot[MODELS + i] = (plot_t){title[i], "period", "error, % of the stroke", line[MODELS + i], 2, PLOT_NO_SHADE};
    }
    reproduction_picture(reproduction, "models",
                         "The last of six periods, held out: loops of the twin and of both models, and the errors.",
                         plot, 2 * MODELS, MODELS);
    for (size_t i = 0; i < MODELS; i++) {
        free(phase[i]);
        free(error_um[i][0]);
        free(error_um[i][1]);
    }
}

static bool describe_tracking(reproduction_t *reproduction, const frequency_t *frequency, const model_t *chain,
                              failure_t *failure) {
    char table[2000];
    size_t length =
        (size_t)snprintf(table, sizeof table,
                         "| sine | without a model | density model | Preisach, one loop | Preisach, reversals | one "
                         "set for all |\n|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < MODELS; i++) {
        const reported_model_t *reported = frequency[i].reported;
        const double range_um =
            0.8 * stroke_002(frequency[i].sine.column[COLUMN_DISPLACEMENT], frequency[i].sine.samples);
        const double middle_um = range_um * 0.7;
        const struct {
            const model_t *model;
            hyst_mode_t mode;
        } ways[] = {{&frequency[i].bank, HYST_MODE_LINEAR},
                    {&frequency[i].density, HYST_MODE_COMPENSATE},
                    {&frequency[i].preisach, HYST_MODE_COMPENSATE},
                    {&frequency[i].reversals_preisach, HYST_MODE_COMPENSATE},
                    {chain, HYST_MODE_COMPENSATE}};
        length += (size_t)snprintf(table + length, sizeof table - length, "| %g Hz, %.1f um |", reported->hz, range_um);
        for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
            tracking_error_t error;
            if (!track_002(ways[w].model, ways[w].mode, reported->hz, middle_um, range_um, 40 + i, &error, failure)) {
                return false;
            }
            length += (size_t)snprintf(table + length, sizeof table - length, " %.2f / %.2f |", error.max_percent,
                                       error.rms_percent);
        }
        length += (size_t)snprintf(table + length, sizeof table - length, "\n");
    }
    reproduction_text(
        reproduction,
        "**Inverse.** The thesis has none for the Preisach model. The inverse of the discrete model is exact "
        "(docs/MODELS.md, section 7). Compiled, and run by lib/hyst in front of the twin, the models track sines "
        "over 80 %% of the stroke with these errors, largest / RMS in %% of the sine's range, mean offset taken "
        "out:\n\n%s",
        table);
    return true;
}

static bool compare_chain(reproduction_t *reproduction, model_t *chain, failure_t *failure) {
    chain_002_case_t cases[MODELS];
    for (size_t i = 0; i < MODELS; i++) {
        const reported_model_t *reported = &reported_models[i];
        cases[i] = (chain_002_case_t){reported->name, reported->hz, reported->top_v, reported->preisach_mean};
    }
    return fit_chain_002(reproduction, cases, MODELS, chain, failure);
}

bool reproduce_002(reproduction_t *reproduction) {
    frequency_t frequency[MODELS] = {{0}};
    model_t chain = {0};
    failure_t failure;
    reproduction_text(
        reproduction,
        "**Twin.** P-753.31C behind an E-505: a first-order lag, a continuum of plays with a density that is not a "
        "Gaussian, a curved reversible part (the reported asymmetry), three relaxations, 0.1 nm of noise and "
        "resolution. Reported are loops and lines (Table 3.1); the twin's numbers (eight, and three time constants "
        "that were set) were tuned to them. Table 3.1 and Table 5.2 pull at the asymmetry from two sides: the first "
        "would like it half as large again, and then no symmetric model could come down to the 1.30 %% of the "
        "second. So the rows of the density model at 0.1 and 10 Hz say that the fit finds what the twin has in it, "
        "and not that the twin had to be like this. Sample rates are not reported: a thousand samples a period were "
        "chosen, two hundred at 100 Hz. Errors are those of the last third of six periods, which the fits did not "
        "see, in %% of the stroke; the thesis judges on what it fitted. The rows hold against Table 5.2. Its text "
        "says otherwise in places: 4.73 and 0.84 %% at 0.1 Hz (density), 0.59 %% as the largest and 2.98 %% as the "
        "mean error at 100 Hz (Preisach), where the largest cannot be below the mean.");
    compare_twin(reproduction);
    bool good = compare_models(reproduction, frequency, &failure);
    if (good) {
        draw(reproduction, frequency);
        good = describe_memory_002(reproduction, &frequency[1].reversals_preisach, &failure) &&
               compare_chain(reproduction, &chain, &failure) &&
               describe_tracking(reproduction, frequency, &chain, &failure);
    }
    for (size_t i = 0; i < MODELS; i++) {
        close_frequency(&frequency[i]);
    }
    model_free(&chain);
    if (!good) {
        failure_print(&failure);
    }
    return good;
}
