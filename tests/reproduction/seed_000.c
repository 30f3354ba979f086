/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Paper 000: stop form of the Prandtl-Ishlinskii model and its inertial-dependent form, on a stack from 10 to 200 Hz at
 * 40 and 80 V under 0 to 12 N. The paper gives strokes and width ratios in numbers and everything else in pictures, so
 * most rows ask whether what it says in words shows up. docs/MODELS.md, section 11.
 */
#include "amplifier.h"
#include "campaign_000.h"
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "electronics_000.h"
#include "identify/fit.h"
#include "reproduction.h"
#include "twins/twin_000.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CLASSICAL, INERTIAL, MODELS };

static const family_t *const tried[MODELS] = {&family_stop_prandtl_ishlinskii, &family_inertial_hysteresis};

/* What the models fitted to each recording alone show. */
typedef struct {
    loop_error_t error[MODELS][CAMPAIGN_RUNS]; /* of the drive */
    double damping[CAMPAIGN_RUNS];             /* V s / um */
} single_fits_t;

static bool fit_runs(const family_t *family, const run_t *runs, size_t count, model_t *model, failure_t *failure) {
    recording_t recordings[CAMPAIGN_RUNS];
    fit_report_t report;
    for (size_t i = 0; i < count; i++) {
        recordings[i] = runs[i].recording;
    }
    if (!fit_recordings(family, recordings, count, &(fit_options_t){0}, model, &report, failure)) {
        return false;
    }
    fit_report_free(&report);
    return true;
}

/* ---- the twin's loops beside the paper's numbers ---- */

static void report_loops(reproduction_t *reproduction, campaign_t *campaign) {
    static const double strokes[2][2] = {{10.12, 9.454}, {21.57, 13.81}}, widths[2] = {3.57, 4.3};
    const size_t last = campaign->frequencies - 1;
    run_t full = {.volts = 120.0, .frequency_hz = 10.0};
    char quantity[160];
    campaign_record(&full, 120);
    reproduction_row(reproduction, "twin: stroke at 120 V, which the maker states with 10 % of tolerance", 36.0,
                     full.stroke_um, "um", MET_EQUAL, 3.6);
    recording_free(&full.recording);
    for (size_t v = 0; v < CAMPAIGN_VOLTAGES; v++) {
        const run_t *slow = campaign_run(campaign, 0, v, 0), *fast = campaign_run(campaign, 0, v, last);
        snprintf(quantity, sizeof quantity, "twin: stroke at %g V, 10 Hz", slow->volts);
        reproduction_row(reproduction, quantity, strokes[v][0], slow->stroke_um, "um", MET_EQUAL, 0.05);
        snprintf(quantity, sizeof quantity, "twin: stroke at %g V, 200 Hz", slow->volts);
        reproduction_row(reproduction, quantity, strokes[v][1], fast->stroke_um, "um", MET_EQUAL, 0.05);
        snprintf(quantity, sizeof quantity, "twin: width of the loop at 200 Hz over that at 10 Hz, %g V", slow->volts);
        reproduction_row(reproduction, quantity, widths[v], fast->width_um / slow->width_um, "1", MET_EQUAL, 0.05);
    }
    reproduction_row(reproduction, "twin: width at 12 N over that at 4 N, 40 V, 200 Hz", 1.06,
                     campaign_run(campaign, 3, 0, last)->width_um / campaign_run(campaign, 1, 0, last)->width_um, "1",
                     MET_EQUAL, 0.01);
    reproduction_row(reproduction, "twin: width at 4 N over that at 12 N, 80 V, 200 Hz", 1.11,
                     campaign_run(campaign, 1, 1, last)->width_um / campaign_run(campaign, 3, 1, last)->width_um, "1",
                     MET_EQUAL, 0.01);
    reproduction_row(reproduction, "twin: stroke at 0 N over that at 12 N, 80 V, 10 Hz: falls with the preload", 1.0,
                     campaign_run(campaign, 0, 1, 0)->stroke_um / campaign_run(campaign, 3, 1, 0)->stroke_um, "1",
                     MET_AT_LEAST, 0.0);
    reproduction_row(reproduction, "twin: asymmetry of the loop at 80 V over that at 40 V, 200 Hz", 1.0,
                     campaign_run(campaign, 0, 1, last)->asymmetry_percent /
                         campaign_run(campaign, 0, 0, last)->asymmetry_percent,
                     "1", MET_AT_LEAST, 0.0);
}

/* ---- a set of numbers for each recording, as the paper's figures ---- */

static bool fit_singles(const campaign_t *campaign, single_fits_t *fits, failure_t *failure) {
    for (size_t i = 0; i < campaign->frequencies * CAMPAIGN_VOLTAGES * CAMPAIGN_PRELOADS; i++) {
        for (size_t m = 0; m < MODELS; m++) {
            model_t model;
            if (!fit_runs(tried[m], &campaign->run[i], 1, &model, failure)) {
                return false;
            }
            fits->error[m][i] = drive_error(&model, &campaign->run[i]);
            if (m == INERTIAL) {
                fits->damping[i] = model_parameter(&model.block[0], "damping_v_s_per_um")->value[0];
            }
            model_free(&model);
        }
    }
    return true;
}

static void report_classical(reproduction_t *reproduction, campaign_t *campaign, const single_fits_t *fits) {
    const loop_error_t *error = fits->error[CLASSICAL];
    const size_t n = campaign->frequencies;
    double amplitude = HUGE_VAL, tips = HUGE_VAL;
    for (size_t v = 0; v < CAMPAIGN_VOLTAGES; v++) {
        char quantity[160];
        snprintf(quantity, sizeof quantity,
                 "classical model, four stops: drive error at 200 Hz over that at 10 Hz, %g V",
                 campaign->run[v * n].volts);
        reproduction_row(reproduction, quantity, 1.0, error[v * n + n - 1].rms / error[v * n].rms, "1", MET_ABOVE, 0.0);
    }
    for (size_t f = 0; f < n; f++) {
        amplitude = fmin(amplitude, error[n + f].rms / error[f].rms);
        for (size_t v = 0; v < CAMPAIGN_VOLTAGES; v++) {
            tips = fmin(tips, error[v * n + f].turning / error[v * n + f].between);
        }
    }
    reproduction_row(reproduction, "classical model: drive error at 80 V over that at 40 V, least of all frequencies",
                     1.0, amplitude, "1", MET_ABOVE, 0.0);
    reproduction_row(reproduction,
                     "classical model: drive error near the turning points over that between them, least of all", 1.0,
                     tips, "1", MET_ABOVE, 0.0);
}

static void report_inertial(reproduction_t *reproduction, campaign_t *campaign, const single_fits_t *fits) {
    const loop_error_t *classical = fits->error[CLASSICAL], *inertial = fits->error[INERTIAL];
    const size_t n = campaign->frequencies, runs = n * CAMPAIGN_VOLTAGES * CAMPAIGN_PRELOADS;
    double worst = 0.0, preloaded = 0.0, others = 0.0, amplitude = HUGE_VAL;
    for (size_t i = 0; i < runs; i++) {
        const double ratio = inertial[i].rms / classical[i].rms;
        *(campaign->run[i].preload_n > 0.0 ? &preloaded : &worst) =
            fmax(campaign->run[i].preload_n > 0.0 ? preloaded : worst, ratio);
    }
    for (size_t i = 0; i < 2 * n - 1; i++) {
        others = fmax(others, inertial[i].rms);
    }
    for (size_t f = 0; f < n; f++) {
        amplitude = fmin(amplitude, fits->damping[n + f] / fits->damping[f]);
    }
    reproduction_row(reproduction, "inertial model: drive error over the classical model's, worst load-free recording",
                     1.0, worst, "1", MET_AT_MOST, 0.0);
    reproduction_row(reproduction, "inertial model: drive error over the classical model's, worst at 4, 8, 12 N", 1.0,
                     preloaded, "1", MET_AT_MOST, 0.0);
    reproduction_row(reproduction, "inertial model: drive error at 80 V, 200 Hz over the largest of all others", 1.0,
                     inertial[2 * n - 1].rms / others, "1", MET_ABOVE, 0.0);
    reproduction_row(reproduction, "inertial model: damping found at 10 Hz over that at 200 Hz, 40 V", 1.0,
                     fits->damping[0] / fits->damping[n - 1], "1", MET_AT_LEAST, 0.0);
    reproduction_row(reproduction, "inertial model: damping found at 10 Hz over that at 200 Hz, 80 V", 1.0,
                     fits->damping[n] / fits->damping[2 * n - 1], "1", MET_AT_LEAST, 0.0);
    reproduction_row(reproduction, "inertial model: damping found at 80 V over that at 40 V, least of all frequencies",
                     1.0, amplitude, "1", MET_AT_LEAST, 0.0);
    reproduction_explain(
        reproduction,
        "The twin's damping rises with the voltage at 10, 25 and 200 Hz, by 2 to 12 %%, not between. The strokes "
        "that the paper prints, 10.12 um at 40 V and 21.57 um at 80 V, leave plays little room: half a branch "
        "F(r) obeys 2 F(20 V) = 10.12 um and 2 F(40 V) = 21.57 um, and the loop at 80 V is 2 F(40 V) - 4 F(20 V) "
        "= 1.33 um wide, 6 %% of the stroke. A curved reversible part widens it to 10 %%, but not to more than "
        "the loop at 40 V has.");
}

static void report_single_table(reproduction_t *reproduction, const campaign_t *campaign, const single_fits_t *fits) {
    const size_t n = campaign->frequencies;
    char table[1900];
    size_t length = (size_t)snprintf(
        table, sizeof table,
        "| drive error, %% of the drive | 40 V classical | inertial | damping, ms V/um | 80 V classical | "
        "inertial | damping, ms V/um |\n|---|---|---|---|---|---|---|\n");
    for (size_t f = 0; f < n && length < sizeof table; f++) {
        length += (size_t)snprintf(table + length, sizeof table - length,
                                   "| %g Hz | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", campaign->frequency_hz[f],
                                   fits->error[CLASSICAL][f].rms, fits->error[INERTIAL][f].rms, 1e3 * fits->damping[f],
                                   fits->error[CLASSICAL][n + f].rms, fits->error[INERTIAL][n + f].rms,
                                   1e3 * fits->damping[n + f]);
    }
    reproduction_text(reproduction, "%s", table);
    reproduction_text(
        reproduction,
        "A set of numbers for each recording, no preload. The damping falls with the frequency as in figure 11 "
        "of the paper. That is what a constant loss per cycle looks like to a dashpot: a loop of hysteresis is "
        "equally wide at every frequency, `c w` is not, and at one frequency four stops and a dashpot explain "
        "the same loop in many ways, mass and stiffness even in one (`x''` is `-w^2 x`). It is no property of "
        "the actuator. That the damping rises again at 80 V, 200 Hz is the limit of the current, which no "
        "spring, mass and dashpot have.");
}

/* ---- one set of numbers for all frequencies ---- */

static bool compare_one_set(reproduction_t *reproduction, campaign_t *campaign, failure_t *failure) {
    enum { SETS = 4 };
    const size_t n = campaign->frequencies, runs = CAMPAIGN_VOLTAGES * n;
    model_t electronics;
    model_t model[SETS][CAMPAIGN_VOLTAGES]; /* classical, inertial, play form: a set a voltage */
    double rms[SETS][CAMPAIGN_RUNS] = {{0}};
    char table[1900];
    size_t length;
    for (size_t v = 0; v < CAMPAIGN_VOLTAGES; v++) {
        const run_t *first = campaign_run(campaign, 0, v, 0);
        if (!fit_runs(tried[CLASSICAL], first, n, &model[0][v], failure) ||
            !fit_runs(tried[INERTIAL], first, n, &model[1][v], failure) ||
            !fit_runs(&family_inertial_prandtl_ishlinskii, first, n, &model[2][v], failure)) {
            return false;
        }
    }
    if (!fit_electronics_and_plays(campaign, runs, &electronics, failure)) {
        return false;
    }
    for (size_t i = 0; i < runs; i++) {
        for (size_t s = 0; s < SETS; s++) {
            loop_error_t error;
            if (!position_error(s < 3 ? &model[s][i / n] : &electronics, &campaign->run[i], &error, failure)) {
                return false;
            }
            rms[s][i] = error.rms;
        }
    }
    length = (size_t)snprintf(
        table, sizeof table,
        "| position error, %% of the stroke | classical | inertial, stop form | inertial, play form | amplifier "
        "and plays |\n|---|---|---|---|---|\n");
    for (size_t i = 0; i < runs && length < sizeof table; i++) {
        length += (size_t)snprintf(table + length, sizeof table - length, "| %s | %.2f | %.2f | %.2f | %.2f |\n",
                                   campaign->run[i].recording.name, rms[0][i], rms[1][i], rms[2][i], rms[3][i]);
    }
    reproduction_row(
        reproduction,
        "one set for 10 to 200 Hz at 40 V: largest position error of the inertial model over the classical's", 1.0,
        fmax(rms[1][0], rms[1][n - 1]) / fmax(rms[0][0], rms[0][n - 1]), "1", MET_AT_MOST, 0.0);
    reproduction_text(reproduction, "%s", table);
    reproduction_text(
        reproduction,
        "One set of numbers for all frequencies (a set a voltage for the first three, *one for both voltages* "
        "for the last: a lag of %.0f Hz, a limit of %.1f kV/s and ten plays). At 40 V the inertial model needs "
        "one set: what it calls damping is the amplifier's lag. Its play form is an expansion to first order and "
        "leaves the square of that lag. At 80 V no set will do, because the amplifier meets its limit.",
        model_parameter(&electronics.block[0], "cutoff_hz")->value[0],
        1e-3 * model_parameter(&electronics.block[1], "limit_v_per_s")->value[0]);
    for (size_t v = 0; v < CAMPAIGN_VOLTAGES; v++) {
        for (size_t s = 0; s < 3; s++) {
            model_free(&model[s][v]);
        }
    }
    model_free(&electronics);
    return true;
}

/* ---- preload ---- */

static bool find_compliance(reproduction_t *reproduction, const campaign_t *campaign, failure_t *failure) {
    run_t slow[CAMPAIGN_PRELOADS];
    model_t model;
    loop_error_t error, worst = {0};
    for (size_t p = 0; p < CAMPAIGN_PRELOADS; p++) {
        slow[p] = campaign->run[(p * CAMPAIGN_VOLTAGES + 1) * campaign->frequencies];
    }
    if (!fit_runs(tried[INERTIAL], slow, CAMPAIGN_PRELOADS, &model, failure)) {
        return false;
    }
    for (size_t p = 0; p < CAMPAIGN_PRELOADS; p++) {
        if (!position_error(&model, &slow[p], &error, failure)) {
            return false;
        }
        worst.rms = fmax(worst.rms, error.rms);
    }
    reproduction_text(
        reproduction,
        "Preload: from the four recordings of 80 V, 10 Hz under 0, 4, 8 and 12 N the inertial model finds a "
        "compliance of %.3f %% of the stroke a newton, and one set of numbers for all four leaves at most %.2f "
        "%% of the stroke. The twin's mount takes %.3f %%.",
        100.0 * model_parameter(model_find(&model, "preload"), "compliance_per_n")->value[0], worst.rms,
        100.0 * twin_000_actuator.stiffness_per_n);
    model_free(&model);
    return true;
}

/* ---- in the amplifier, which the paper announces and does not do ---- */

static double sample(void *state, double drive_v) {
    twin_000_t *twin = state;
    const double measured = twin_000_measure(twin, twin->position_um);
    twin->drive_v = drive_v; /* held, not a ramp */
    twin_000_step(twin, drive_v);
    return measured;
}

static bool track(const model_t *model, hyst_mode_t mode, double frequency_hz, tracking_error_t *error,
                  failure_t *failure) {
    const compile_options_t options = {
        .drive_range_v = {-10.0, 50.0}, .position_range_um = {-2.0, 12.0}, .delay_s = 1.0 / CAMPAIGN_000_RATE_HZ};
    const sine_track_t sine = {.mode = mode,
                               .offset_um = 5.0,
                               .amplitude_um = 3.0,
                               .frequency_hz = frequency_hz,
                               .settle_s = 0.3,
                               .samples = 4000};
    hyst_parameters_t image;
    recording_t recording;
    twin_000_t twin;
    twin_000_open(&twin, &twin_000_actuator, CAMPAIGN_000_RATE_HZ, 0.0, 99);
    const actuator_t actuator = {&twin, sample};
    if (!compile_model(model, &options, &image, NULL, failure)) {
        return false;
    }
    image.drive_low = drive_from_volts(&image, 0.0); /* what the stack may be driven to, not what was recorded */
    image.drive_high = drive_from_volts(&image, 45.0);
    if (!amplifier_track(&image, &actuator, &sine, &recording, failure)) {
        return false;
    }
    *error = tracking_error(&recording, 2.0 * sine.amplitude_um);
    recording_free(&recording);
    return true;
}

static bool track_through_the_amplifier(reproduction_t *reproduction, campaign_t *campaign, failure_t *failure) {
    static const double frequencies[] = {10.0, 50.0, 100.0, 200.0};
    model_t model[MODELS];
    char table[1000];
    size_t length = (size_t)snprintf(
        table, sizeof table,
        "| largest (RMS) error, 6 um sine, %% of 6 um | without a model | stop form, from 10 Hz | inertial model "
        "|\n|---|---|---|---|\n");
    if (!fit_runs(tried[CLASSICAL], campaign_run(campaign, 0, 0, 0), 1, &model[CLASSICAL], failure) ||
        !fit_runs(tried[INERTIAL], campaign_run(campaign, 0, 0, 0), campaign->frequencies, &model[INERTIAL], failure)) {
        return false;
    }
    for (size_t f = 0; f < sizeof frequencies / sizeof frequencies[0] && length < sizeof table; f++) {
        tracking_error_t e[3];
        if (!track(&model[CLASSICAL], HYST_MODE_LINEAR, frequencies[f], &e[0], failure) ||
            !track(&model[CLASSICAL], HYST_MODE_COMPENSATE, frequencies[f], &e[1], failure) ||
            !track(&model[INERTIAL], HYST_MODE_COMPENSATE, frequencies[f], &e[2], failure)) {
            return false;
        }
        length +=
            (size_t)snprintf(table + length, sizeof table - length,
                             "| %g Hz | %.2f (%.2f) | %.2f (%.2f) | %.2f (%.2f) |\n", frequencies[f], e[0].max_percent,
                             e[0].rms_percent, e[1].max_percent, e[1].rms_percent, e[2].max_percent, e[2].rms_percent);
    }
    reproduction_text(reproduction, "%s", table);
    reproduction_text(
        reproduction,
        "Beyond the paper: both models compiled, in the amplifier in front of the twin at %g kHz. The inertial "
        "model is the one set for all frequencies at 40 V; its mass and damper are driven for by the inertia "
        "section, beside the inverse play bank.",
        1e-3 * CAMPAIGN_000_RATE_HZ);
    model_free(&model[CLASSICAL]);
    model_free(&model[INERTIAL]);
    return true;
}

static void draw(reproduction_t *reproduction, campaign_t *campaign, const single_fits_t *fits) {
    const size_t n = campaign->frequencies;
    double error[MODELS][2][CAMPAIGN_FREQUENCIES], damping[2][CAMPAIGN_FREQUENCIES];
    plot_line_t loops[2][2];
    for (size_t v = 0; v < 2; v++) {
        for (size_t f = 0; f < n; f++) {
            error[CLASSICAL][v][f] = fits->error[CLASSICAL][v * n + f].rms;
            error[INERTIAL][v][f] = fits->error[INERTIAL][v * n + f].rms;
            damping[v][f] = 1e3 * fits->damping[v * n + f];
        }
        for (size_t i = 0; i < 2; i++) {
            const run_t *run = campaign_run(campaign, 0, v, i == 0 ? 0 : n - 1);
            const size_t last = run->recording.samples - run->period;
            loops[v][i] = (plot_line_t){i == 0 ? "before" : "after", i == 0 ? "10 Hz" : "200 Hz",
                                        run->recording.column[COLUMN_DRIVE] + last,
                                        run->recording.column[COLUMN_DISPLACEMENT] + last, run->period};
        }
    }
    const double *hz = campaign->frequency_hz;
    const plot_line_t low[] = {{"before", "classical", hz, error[CLASSICAL][0], n},
                               {"after", "inertial", hz, error[INERTIAL][0], n}};
    const plot_line_t high[] = {{"before", "classical", hz, error[CLASSICAL][1], n},
                                {"after", "inertial", hz, error[INERTIAL][1], n}};
    const plot_line_t dampings[] = {{"before", "40 V", hz, damping[0], n}, {"after", "80 V", hz, damping[1], n}};
    const plot_t plots[] = {{"Loops at 40 V", "drive (V)", "position (um)", loops[0], 2, PLOT_NO_SHADE},
                            {"Loops at 80 V", "drive (V)", "position (um)", loops[1], 2, PLOT_NO_SHADE},
                            {"Damping found", "frequency (Hz)", "ms V/um", dampings, 2, PLOT_NO_SHADE},
                            {"Drive error at 40 V", "frequency (Hz)", "% of the drive", low, 2, PLOT_NO_SHADE},
                            {"Drive error at 80 V", "frequency (Hz)", "% of the drive", high, 2, PLOT_NO_SHADE}};
    reproduction_picture(
        reproduction, "loops",
        "The twin's loops, the damping of each recording's own fit (figure 11 of the paper), and the error of "
        "both models (figures 7 and 9).",
        plots, sizeof plots / sizeof plots[0], 3);
}

bool reproduce_000(reproduction_t *reproduction) {
    campaign_t *campaign = allocate(1, sizeof *campaign);
    single_fits_t *fits = allocate(1, sizeof *fits);
    failure_t failure = {{0}};
    bool good;
    reproduction_text(
        reproduction,
        "Stack P-887.90 behind an E-663 amplifier, sines from 0 V to 40 and 80 V, 10 to 200 Hz, 0 to 12 N. The "
        "twin is an amplifier that charges the stack through a resistance with a limited current, a continuum of "
        "plays with a curved reversible part, and a mode at 6 kHz; sampled at 20 kHz. The paper does not report "
        "the sample rate, the hysteresis, the mode, what the amplifier does, or any error in numbers: all that "
        "is chosen. The current limit is not a guess: no linear lag loses 6.6 %% of the stroke at 40 V and 36 %% "
        "at 80 V, and the loops turn asymmetric at 125 Hz with 80 V and at 250 Hz with 40 V, which is one and "
        "the same rate, 31 kV/s. On the preload the text contradicts itself (wider at 12 N for 40 V, wider at 4 "
        "N for 80 V, wider with preload in the summary); the twin does the two that have numbers, and one cause "
        "does for both, a load of the amplifier that grows with the preload: more lag at 40 V, less current left "
        "for the stroke at 80 V.");
    campaign_open(campaign, reproduction_reduced(reproduction));
    report_loops(reproduction, campaign);
    good = fit_singles(campaign, fits, &failure);
    if (good) {
        draw(reproduction, campaign, fits);
        report_classical(reproduction, campaign, fits);
        report_inertial(reproduction, campaign, fits);
        report_single_table(reproduction, campaign, fits);
    }
    good = good && compare_one_set(reproduction, campaign, &failure) &&
           find_compliance(reproduction, campaign, &failure) &&
           track_through_the_amplifier(reproduction, campaign, &failure);
    if (!good) {
        fprintf(stderr, "reproduce 000: %s\n", failure.text);
    }
    campaign_free(campaign);
    free(campaign);
    free(fits);
    return good;
}
