/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numbers.h"
#include "numerics/golden_section.h"
#include "numerics/least_squares.h"
#include "numerics/sine_fit.h"
#include "recording/recording.h"
#include <gsl/gsl_math.h>
#include <gsl/gsl_sort.h>
#include <gsl/gsl_statistics_double.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Opens a recording. Sets *there to false, and succeeds, where there is none of that name. */
static bool open_recording(const char *folder, const char *name, recording_t *recording, bool *there,
                           failure_t *failure) {
    char path[1000];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    *there = access(path, R_OK) == 0;
    return !*there || recording_read(recording, path, failure);
}

enum { MOST_COLUMNS = 5 };

/* What least squares leave of y, rms; x receives the unknowns. Columns are stored one after the other. */
static bool least_rms(const double *columns, const double *y, size_t count, size_t unknowns, double *x, double *rms,
                      failure_t *failure) {
    normal_equations_t equations;
    double row[MOST_COLUMNS], lower[MOST_COLUMNS];
    normal_equations_create(&equations, unknowns);
    for (size_t i = 0; i < unknowns; i++) {
        lower[i] = -HUGE_VAL;
    }
    for (size_t k = 0; k < count; k++) {
        for (size_t i = 0; i < unknowns; i++) {
            row[i] = columns[i * count + k];
        }
        normal_equations_add(&equations, row, y[k]);
    }
    normal_equations_finish(&equations);
    const bool good = solve_bounded(&equations, lower, x, NULL, failure);
    *rms = good ? sqrt(squared_error(&equations, x) / (double)count) : 0.0;
    normal_equations_free(&equations);
    return good;
}

/* ---- stack-p885-1hz: 40 periods of one sine ---- */

enum { PERIODS = 40, SKIPPED = 2 }; /* the way from the first level is no loop yet */

typedef struct {
    double mean[PERIODS - SKIPPED], lag_ms[PERIODS - SKIPPED], amplitude[PERIODS - SKIPPED], time[PERIODS - SKIPPED];
    double second_percent; /* mean amplitude of the second harmonic, of the first */
} stack_periods_t;

static bool measure_stack(const recording_t *recording, stack_periods_t *periods, failure_t *failure) {
    const size_t n = (size_t)recording->sample_rate_hz; /* 1 Hz */
    *periods = (stack_periods_t){0};
    if (recording->samples < PERIODS * n) {
        return fail(failure, "%s: fewer than %d s", recording->name, PERIODS);
    }
    for (size_t i = 0; i < PERIODS - SKIPPED; i++) {
        const size_t from = (i + SKIPPED) * n;
        const double *y = recording->column[COLUMN_DISPLACEMENT] + from, *u = recording->column[COLUMN_DRIVE] + from;
        sine_t drive = {0}, first = {0}, second = {0};
        if (!sine_fit_at(u, n, recording->sample_rate_hz, 1.0, &drive, failure) ||
            !sine_fit_at(y, n, recording->sample_rate_hz, 1.0, &first, failure) ||
            !sine_fit_at(y, n, recording->sample_rate_hz, 2.0, &second, failure)) {
            return false;
        }
        periods->time[i] = (double)from / recording->sample_rate_hz + 0.5;
        periods->mean[i] = first.offset;
        periods->amplitude[i] = first.amplitude;
        periods->lag_ms[i] = 1e3 * remainder(drive.phase - first.phase, 2.0 * M_PI) / (2.0 * M_PI);
        periods->second_percent += 100.0 * second.amplitude / first.amplitude / (PERIODS - SKIPPED);
    }
    return true;
}

typedef struct {
    const stack_periods_t *periods;
    double rms_um, rise_um;
    failure_t *failure;
} settling_t;

/* The periods' means as offset + rise * shape(time): the logarithm of the time, or an exponential. */
static bool fit_means(settling_t *settling, double time_constant_s, double *rms) {
    enum { COUNT = PERIODS - SKIPPED };
    double columns[2 * COUNT], x[2] = {0.0};
    for (size_t i = 0; i < COUNT; i++) {
        const double t = settling->periods->time[i];
        columns[i] = 1.0;
        columns[COUNT + i] = time_constant_s > 0.0 ? -exp(-t / time_constant_s) : log10(t);
    }
    const bool good = least_rms(columns, settling->periods->mean, COUNT, 2, x, rms, settling->failure);
    settling->rise_um = x[1];
    return good;
}

static bool exponential_rms(void *context, double log_time_constant, double *rms) {
    return fit_means(context, exp(log_time_constant), rms);
}

static bool numbers_stack(const char *folder, json_t *numbers, failure_t *failure) {
    enum { COUNT = PERIODS - SKIPPED };
    recording_t recording;
    stack_periods_t periods;
    bool there;
    if (!open_recording(folder, "stack-p885-1hz.csv", &recording, &there, failure) || !there) {
        return !there;
    }
    settling_t settling = {.periods = &periods, .failure = failure};
    double log_rms = 0.0, exponential = 0.0, time_constant = 0.0, step[COUNT - 1], sorted[COUNT - 1];
    bool good = measure_stack(&recording, &periods, failure) && fit_means(&settling, 0.0, &log_rms);
    const double rise_um = settling.rise_um;
    good = good && golden_section(exponential_rms, &settling, log(1.0), log(100.0), 30, &time_constant) &&
           exponential_rms(&settling, time_constant, &exponential);
    if (good) {
        double steps_ms = 0.0;
        int steps = 0;
        const double amplitude = gsl_stats_mean(periods.amplitude, 1, COUNT);
        for (size_t i = 0; i + 1 < COUNT; i++) {
            sorted[i] = step[i] = periods.lag_ms[i + 1] - periods.lag_ms[i];
        }
        gsl_sort(sorted, 1, COUNT - 1);
        for (size_t i = 0; i + 1 < COUNT; i++) {
            if (step[i] > 0.4) { /* ms; all others are below 0.2 */
                steps_ms += step[i];
                steps++;
            }
        }
        const number_t list[] = {
            {"rise_um_per_decade", rise_um},
            {"rise_percent_per_decade", 100.0 * rise_um / amplitude},
            {"log_rms_nm", 1e3 * log_rms},
            {"exponential_rms_nm", 1e3 * exponential},
            {"time_constant_s", exp(time_constant)},
            {"clock_us_per_s", -1e3 * gsl_stats_median_from_sorted_data(sorted, 1, COUNT - 1)},
            {"clock_steps", steps},
            {"clock_step_ms", steps > 0 ? steps_ms / steps : 0.0},
            {"lag_sd_um", gsl_stats_sd(periods.lag_ms, 1, COUNT) * 1e-3 * 2.0 * M_PI * amplitude * M_SQRT1_2},
            {"second_percent", periods.second_percent}};
        good = numbers_add(numbers, "stack", list, sizeof list / sizeof list[0], failure);
    }
    recording_free(&recording);
    return good;
}

/* ---- actuator-150v-1hz: rest, a jump into the sine, six periods ---- */

typedef struct {
    const double *y; /* from `AFTER` samples behind the jump on */
    double rate_hz, frequency_hz, amplitude_um;
    failure_t *failure;
} ring_t;

enum { RING = 150, AFTER = 15 }; /* samples; a second, faster mode has died away by then */

/* A parabola and a decaying sine. */
static bool ring_rms(const ring_t *ring, double frequency_hz, double decay_per_s, double *rms, double *amplitude) {
    static double columns[MOST_COLUMNS * RING];
    double x[MOST_COLUMNS] = {0.0};
    for (size_t k = 0; k < RING; k++) {
        const double t = (double)k / ring->rate_hz, decayed = exp(-decay_per_s * t);
        columns[k] = 1.0;
        columns[RING + k] = t;
        columns[2 * RING + k] = t * t;
        columns[3 * RING + k] = decayed * cos(2.0 * M_PI * frequency_hz * t);
        columns[4 * RING + k] = decayed * sin(2.0 * M_PI * frequency_hz * t);
    }
    const bool good = least_rms(columns, ring->y, RING, MOST_COLUMNS, x, rms, ring->failure);
    *amplitude = hypot(x[3], x[4]);
    return good;
}

/* A grid: the error has many minima over the frequency. */
static bool find_ring(ring_t *ring, double *damping_ratio, double *rms_um) {
    *rms_um = HUGE_VAL;
    for (int f = 0; f <= 750; f++) {
        for (int d = 0; d <= 40; d++) {
            const double hz = 500.0 + 2.0 * f, ratio = 0.004 * pow(1.1, d);
            double rms, amplitude;
            if (!ring_rms(ring, hz, 2.0 * M_PI * hz * ratio, &rms, &amplitude)) {
                return false;
            }
            if (rms < *rms_um) {
                *rms_um = rms;
                *damping_ratio = ratio;
                ring->frequency_hz = hz;
                ring->amplitude_um = amplitude;
            }
        }
    }
    return true;
}

/* The equation that the authors of the recording learned from it, as their published program has it
 * (Exp6_Real_Piezo.py), integrated over the samples that they used. Fourth order, from the first sample. */
enum { LEARNED_FROM = 35000, LEARNED_TO = 45000 };
static double learned_rate(double y, double drive_v, double drive_v_per_s) {
    return -0.176 - 2.388 * y + 0.581 * drive_v + 0.119 * drive_v_per_s - 0.076 * y * fabs(y);
}

static double learned_rate_at(double y, double t) {
    const double phase = 6.28318530724 * t - 46.2178545458;
    return learned_rate(y, 150.0 * sin(phase), 942.477796086 * cos(phase));
}

static double learned_nrmse_percent(const recording_t *recording) {
    const double h = 1.0 / recording->sample_rate_hz, *measured = recording->column[COLUMN_DISPLACEMENT];
    double y = measured[LEARNED_FROM], sum = 0.0, range[2];
    for (size_t k = LEARNED_FROM; k < LEARNED_TO; k++) {
        const double t = recording->start_s + (double)k * h, k1 = learned_rate_at(y, t);
        const double k2 = learned_rate_at(y + 0.5 * h * k1, t + 0.5 * h),
                     k3 = learned_rate_at(y + 0.5 * h * k2, t + 0.5 * h);
        sum += gsl_pow_2(y - measured[k]);
        y += h / 6.0 * (k1 + 2.0 * (k2 + k3) + learned_rate_at(y + h * k3, t + h));
    }
    values_range(measured + LEARNED_FROM, LEARNED_TO - LEARNED_FROM, range);
    return 100.0 * sqrt(sum / (LEARNED_TO - LEARNED_FROM)) / (range[1] - range[0]);
}

static bool numbers_actuator(const char *folder, json_t *numbers, failure_t *failure) {
    recording_t recording;
    bool there;
    if (!open_recording(folder, "actuator-150v-1hz.csv", &recording, &there, failure) || !there) {
        return !there;
    }
    const double *u = recording.column[COLUMN_DRIVE], *y = recording.column[COLUMN_DISPLACEMENT];
    size_t jump = 0;
    while (jump + 1 < recording.samples && u[jump] == 0.0) {
        jump++;
    }
    double damping_ratio = 0.0, rms_um = 0.0;
    ring_t ring = {.rate_hz = recording.sample_rate_hz, .failure = failure};
    bool good = (recording.samples >= LEARNED_TO && jump > 1 && jump + AFTER + RING <= recording.samples) ||
                fail(failure, "%s: not the recording that its authors' program reads", recording.name);
    if (good) {
        ring.y = y + jump + AFTER;
        good = find_ring(&ring, &damping_ratio, &rms_um);
    }
    if (good) {
        const double rest_um = gsl_stats_mean(y, 1, jump);
        const number_t list[] = {{"rest_s", (double)jump / recording.sample_rate_hz},
                                 {"rest_um", rest_um},
                                 {"rest_sd_um", gsl_stats_sd(y, 1, jump)},
                                 {"rest_rate_um_per_s", learned_rate(rest_um, 0.0, 0.0)},
                                 {"jump_v", u[jump]},
                                 {"ring_hz", ring.frequency_hz},
                                 {"ring_damping", damping_ratio},
                                 {"ring_um", ring.amplitude_um},
                                 {"learned_nrmse_percent", learned_nrmse_percent(&recording)}};
        good = numbers_add(numbers, "actuator", list, sizeof list / sizeof list[0], failure);
    }
    recording_free(&recording);
    return good;
}

bool numbers_measured(const char *folder, json_t *numbers, failure_t *failure) {
    return numbers_stack(folder, numbers, failure) && numbers_actuator(folder, numbers, failure);
}
