/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/stop_fit.h"
#include "identify/play_basis.h"
#include "numerics/least_squares.h"
#include "numerics/moving_average.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Columns of the linear problem; the drive follows the last one. */
enum { OFFSET, STIFFNESS, FIRST_STOP };

/* k is at least this part of drive range over displacement range: the slope of the inverse stays finite. */
static const double least_stiffness_part = 0.05;
/* Noise may make up this part of the power of the acceleration's column: it lowers the mass by about as much. */
static const double acceptable_noise = 1e-4;
enum { AVERAGES = 4, LONGEST_SMOOTHING = 64 };

typedef struct {
    size_t stops, columns;
    bool inertial;
    double center_v, center_um, least_stiffness;
} layout_t;

/* Columns of one recording, one after the other, `samples` each. */
typedef struct {
    size_t samples;
    double *value;
} columns_t;

static bool lay_out(const stop_problem_t *problem, const recording_t *relaxed, layout_t *layout, double *threshold_um,
                    failure_t *failure) {
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL}, half = 0.0, slope = HUGE_VAL;
    for (size_t i = 0; i < problem->job->count; i++) {
        double drive[2], position[2];
        values_range(relaxed[i].column[COLUMN_DISPLACEMENT], problem->job->train_to[i], drive);
        values_range(relaxed[i].column[COLUMN_DRIVE], problem->job->train_to[i], position);
        if (!(drive[1] > drive[0]) || !(position[1] > position[0])) {
            return fail(failure, "%s: nothing moves in its training part", relaxed[i].name);
        }
        low[0] = fmin(low[0], drive[0]);
        high[0] = fmax(high[0], drive[1]);
        low[1] = fmin(low[1], position[0]);
        high[1] = fmax(high[1], position[1]);
        half = fmax(half, 0.5 * (position[1] - position[0]));
        slope = fmin(slope, (drive[1] - drive[0]) / (position[1] - position[0]));
    }
    *layout = (layout_t){.stops = problem->operators,
                         .columns = FIRST_STOP + problem->operators + (problem->inertial ? 2 : 0),
                         .inertial = problem->inertial,
                         .center_v = 0.5 * (low[0] + high[0]),
                         .center_um = 0.5 * (low[1] + high[1]),
                         .least_stiffness = least_stiffness_part * slope};
    for (size_t i = 0; i < problem->operators; i++) {
        threshold_um[i] = half * (double)(i + 1) / (double)(problem->operators + 1);
    }
    return true;
}

/* The recordings with drive and displacement swapped, the latter reduced to that without preload. */
static recording_t *relax(const stop_problem_t *problem, double compliance_per_n) {
    recording_t *relaxed = allocate(problem->job->count, sizeof *relaxed);
    for (size_t i = 0; i < problem->job->count; i++) {
        const recording_t *recording = &problem->job->recordings[i];
        const double factor = 1.0 + compliance_per_n * problem->preload_n[i];
        double *position = allocate(recording->samples, sizeof(double));
        for (size_t k = 0; k < problem->job->train_to[i]; k++) {
            position[k] = recording->column[COLUMN_DISPLACEMENT][k] * factor;
        }
        relaxed[i] = *recording;
        relaxed[i].column[COLUMN_DRIVE] = position;
        relaxed[i].column[COLUMN_DISPLACEMENT] = recording->column[COLUMN_DRIVE];
    }
    return relaxed;
}

static void relaxed_free(recording_t *relaxed, size_t count) {
    for (size_t i = 0; i < count; i++) {
        free(relaxed[i].column[COLUMN_DRIVE]); /* everything else is borrowed */
    }
    free(relaxed);
}

static columns_t make_columns(const layout_t *layout, const play_basis_t *basis, const recording_t *relaxed,
                              size_t to) {
    const size_t from = play_memory_as_determined_as_possible(basis, relaxed, to), samples = to - from;
    const double *position = relaxed->column[COLUMN_DRIVE] + from;
    columns_t columns = {.samples = samples, .value = allocate((layout->columns + 1) * samples, sizeof(double))};
    double *const stop = columns.value + FIRST_STOP * samples, *drive = columns.value + layout->columns * samples;
    play_walk_t walk;
    play_walk_begin(&walk, basis, relaxed, NULL);
    for (size_t k = 0; k < from; k++) {
        play_walk_step(&walk);
    }
    for (size_t k = 0; k < samples; k++) {
        play_walk_step(&walk);
        columns.value[OFFSET * samples + k] = 1.0;
        columns.value[STIFFNESS * samples + k] = position[k] - layout->center_um;
        for (size_t i = 0; i < layout->stops; i++) {
            stop[i * samples + k] = position[k] - walk.memory_v[i];
        }
        drive[k] = relaxed->column[COLUMN_DISPLACEMENT][from + k] - layout->center_v;
    }
    play_walk_end(&walk);
    return columns;
}

/*
 * Adds rate and acceleration. The trapezoidal rule replaces d/dt by (2 / dt) (1 - q) / (1 + q), q one sample back.
 * Multiplied by (1 + q)^2 / 4, the equation has (1 - q^2) / (2 dt) and (1 - q)^2 / dt^2 for them, and a 1 2 1 average
 * of all the rest.
 */
static void add_motion(const layout_t *layout, columns_t *columns, double rate_hz) {
    const size_t n = columns->samples;
    double *rate = columns->value + (FIRST_STOP + layout->stops) * n, *acceleration = rate + n;
    const double *position = columns->value + STIFFNESS * n;
    for (size_t k = 0; k + 2 < n; k++) {
        rate[k] = 0.5 * rate_hz * (position[k + 2] - position[k]);
        acceleration[k] = rate_hz * rate_hz * (position[k + 2] - 2.0 * position[k + 1] + position[k]);
    }
    for (size_t c = 0; c <= layout->columns; c++) {
        double *column = columns->value + c * n;
        if (column != rate && column != acceleration) {
            for (size_t k = 0; k + 2 < n; k++) {
                column[k] = 0.25 * (column[k] + 2.0 * column[k + 1] + column[k + 2]);
            }
        }
    }
}

/* Power of white noise of deviation 1 in the acceleration after the averages. */
static double noise_gain(size_t length, double rate_hz) {
    enum { RESPONSE = 3 + AVERAGES * (LONGEST_SMOOTHING - 1) };
    double response[2 * RESPONSE] = {0}, power = 0.0;
    const double scale = rate_hz * rate_hz;
    response[RESPONSE - 3] = scale; /* the averages look forward */
    response[RESPONSE - 2] = -2.0 * scale;
    response[RESPONSE - 1] = scale;
    for (int i = 0; i < AVERAGES; i++) {
        moving_average(response, 2 * RESPONSE, length);
    }
    for (size_t k = 0; k < RESPONSE; k++) {
        power += response[k] * response[k];
    }
    return power;
}

/* The sensor's noise power from sixth differences, which leave next to nothing of a motion far below the sample rate.
 */
static double noise_power(const double *position, size_t samples) {
    double power = 0.0;
    for (size_t k = 6; k < samples; k++) {
        const double sixth = position[k] - 6.0 * position[k - 1] + 15.0 * position[k - 2] - 20.0 * position[k - 3] +
                             15.0 * position[k - 4] - 6.0 * position[k - 5] + position[k - 6];
        power += sixth * sixth / 924.0; /* 1 + 36 + 225 + 400 + 225 + 36 + 1 */
    }
    return power / (double)(samples - 6);
}

/* Mean powers of the acceleration's column of all recordings, and of the noise in it, at this smoothing. */
static void acceleration_power(const stop_problem_t *problem, const recording_t *relaxed, size_t length, double *power,
                               double *noise) {
    size_t useful = 0;
    *power = *noise = 0.0;
    for (size_t i = 0; i < problem->job->count; i++) {
        const double *position = relaxed[i].column[COLUMN_DRIVE], rate = relaxed[i].sample_rate_hz;
        const size_t samples = problem->job->train_to[i] - 2, kept = samples - AVERAGES * (length - 1);
        double *acceleration = allocate(samples, sizeof(double));
        for (size_t k = 0; k < samples; k++) {
            acceleration[k] = rate * rate * (position[k + 2] - 2.0 * position[k + 1] + position[k]);
        }
        for (int a = 0; a < AVERAGES; a++) {
            moving_average(acceleration, samples, length);
        }
        for (size_t k = 0; k < kept; k++) {
            *power += acceleration[k] * acceleration[k];
        }
        *noise += noise_power(position, samples) * noise_gain(length, rate) * (double)kept;
        useful += kept;
        free(acceleration);
    }
    *power /= (double)useful;
    *noise /= (double)useful;
}

/*
 * The shortest smoothing that makes the noise small beside the acceleration. It fits into a quarter of the shortest
 * recording, and does not remove the motion itself: it stops when a step halves the power.
 */
static size_t choose_smoothing(const stop_problem_t *problem, const recording_t *relaxed) {
    size_t longest = LONGEST_SMOOTHING, length = 1;
    double motion = 0.0;
    for (size_t i = 0; i < problem->job->count; i++) {
        while (longest > 1 && 4 * AVERAGES * longest > problem->job->train_to[i]) {
            longest /= 2;
        }
    }
    for (;; length *= 2) {
        double power, noise;
        acceleration_power(problem, relaxed, length, &power, &noise);
        if (motion > 0.0 && power - noise < 0.5 * motion) {
            return length / 2;
        }
        if (noise <= acceptable_noise * power || 2 * length > longest) {
            return length;
        }
        motion = noise < 0.1 * power ? power - noise : 0.0; /* else next to nothing is known of it */
    }
}

static bool solve(const layout_t *layout, normal_equations_t *equations, stop_fit_t *fit, failure_t *failure) {
    double lower[FIRST_STOP + STOP_FIT_MAX_OPERATORS + 2] = {
        [OFFSET] = -HUGE_VAL, [STIFFNESS] = layout->least_stiffness};
    double x[FIRST_STOP + STOP_FIT_MAX_OPERATORS + 2];
    normal_equations_finish(equations);
    if (!solve_bounded(equations, lower, x, NULL, failure)) {
        return false;
    }
    memcpy(fit->weight, x + STIFFNESS, (layout->stops + 1) * sizeof(double));
    fit->offset_v = layout->center_v + x[OFFSET] - x[STIFFNESS] * layout->center_um;
    fit->damping = layout->inertial ? x[FIRST_STOP + layout->stops] : 0.0;
    fit->mass = layout->inertial ? x[FIRST_STOP + layout->stops + 1] : 0.0;
    fit->rms_v = sqrt(squared_error(equations, x) / (double)equations->rows);
    return true;
}

static void add_rows(normal_equations_t *equations, const layout_t *layout, const columns_t *columns, size_t rows) {
    double row[FIRST_STOP + STOP_FIT_MAX_OPERATORS + 2];
    for (size_t k = 0; k < rows; k++) {
        for (size_t c = 0; c < layout->columns; c++) {
            row[c] = columns->value[c * columns->samples + k];
        }
        normal_equations_add(equations, row, columns->value[layout->columns * columns->samples + k]);
    }
}

/* `lost` values at the end are of no use after the averages. */
static void add_recording(normal_equations_t *equations, const layout_t *layout, const play_basis_t *basis,
                          const recording_t *relaxed, size_t to, size_t smoothing) {
    const size_t lost = layout->inertial ? 2 + AVERAGES * (smoothing - 1) : 0;
    columns_t columns = make_columns(layout, basis, relaxed, to);
    if (columns.samples > lost) {
        if (layout->inertial) {
            add_motion(layout, &columns, relaxed->sample_rate_hz);
            for (size_t a = 0; a < AVERAGES * (layout->columns + 1); a++) {
                moving_average(columns.value + a / AVERAGES * columns.samples, columns.samples, smoothing);
            }
        }
        add_rows(equations, layout, &columns, columns.samples - lost);
    }
    free(columns.value);
}

static bool fit_relaxed(const stop_problem_t *problem, const recording_t *relaxed, stop_fit_t *fit,
                        failure_t *failure) {
    const play_basis_t basis = {.operators = problem->operators, .threshold_v = fit->threshold_um};
    normal_equations_t equations;
    layout_t layout = {0};
    bool good;
    if (!lay_out(problem, relaxed, &layout, fit->threshold_um, failure)) {
        return false;
    }
    fit->smoothing = problem->inertial ? choose_smoothing(problem, relaxed) : 1;
    normal_equations_create(&equations, layout.columns);
    for (size_t i = 0; i < problem->job->count; i++) {
        add_recording(&equations, &layout, &basis, &relaxed[i], problem->job->train_to[i], fit->smoothing);
    }
    good = solve(&layout, &equations, fit, failure);
    normal_equations_free(&equations);
    return good;
}

bool stop_fit(const stop_problem_t *problem, double compliance_per_n, stop_fit_t *fit, failure_t *failure) {
    recording_t *relaxed = relax(problem, compliance_per_n);
    const bool good = fit_relaxed(problem, relaxed, fit, failure);
    relaxed_free(relaxed, problem->job->count);
    return good;
}
