/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * The loop of a sine as an ellipse: gain and time lag that depend on the frequency, which is measured in the drive.
 *
 *     y(t) = y_c + k(f) (u(t - d(f)) - u_c)
 *
 * docs/MODELS.md, section 13. Exact for a sine of a frequency in the table; between table frequencies gain and phase
 * follow a monotone cubic over log f, outside of them the nearest frequency's k and d hold. One amplitude, one bias.
 * Optionally, at low frequencies, the two halves of the loop have separate ellipses, which gives the loop sharp tips.
 */
#include "chain/catalogue.h"
#include "compile/compile_job.h"
#include "elements/phaser.h"
#include "numerics/period_tracker.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum {
    FREQUENCIES,
    MAJOR,
    MINOR,
    ANGLE,
    X_CENTER,
    Y_CENTER,
    DRIVE_RANGE,
    DISPLACEMENT_RANGE,
    HALVES,
    ASCENDING,
    DESCENDING
};

/* Ellipses of halves stand one after the other, five numbers each. */
enum { HALF_NUMBERS = 5 };

static const parameter_info_t parameters[] = {
    {.name = "frequencies_hz",
     .unit = "Hz",
     .low = 1e-2,
     .high = 1e9,
     .array = true,
     .rising = true,
     .chosen = true,
     .text = "of the sines whose ellipses are given, strictly rising"},
    {.name = "major", .unit = "1", .low = 1e-9, .high = 1e6, .array = true, .text = "major radius, a frequency each"},
    {.name = "minor", .unit = "1", .low = 1e-9, .high = 1e6, .array = true, .text = "minor radius"},
    {.name = "angle_rad",
     .unit = "rad",
     .low = 0.0,
     .high = M_PI_2,
     .array = true,
     .text = "of the major axis against the axis of the drive"},
    {.name = "x_center", .unit = "1", .low = -1e6, .high = 1e6, .array = true, .text = "centre, drive"},
    {.name = "y_center", .unit = "1", .low = -1e6, .high = 1e6, .array = true, .text = "centre, displacement"},
    {.name = "drive_range_v",
     .unit = "V",
     .low = 1e-9,
     .high = 1e9,
     .chosen = true,
     .text = "drive that is 1 in the ellipses' plane"},
    {.name = "displacement_range_um",
     .unit = "um",
     .low = 1e-9,
     .high = 1e9,
     .chosen = true,
     .text = "displacement that is 1 in the ellipses' plane"},
    {.name = "halves_hz",
     .unit = "Hz",
     .low = 1e-2,
     .high = 1e9,
     .array = true,
     .rising = true,
     .optional = true,
     .chosen = true,
     .text = "frequencies at which each half of the loop has its own ellipse; used up to the last of them"},
    {.name = "ascending",
     .unit = "1",
     .low = -1e6,
     .high = 1e6,
     .array = true,
     .optional = true,
     .text = "major, minor, angle, x and y centre of the ascending half, a frequency each"},
    {.name = "descending",
     .unit = "1",
     .low = -1e6,
     .high = 1e6,
     .array = true,
     .optional = true,
     .text = "the same of the descending half"}};

static phaser_row_t row_of(const parameter_t *parameter, size_t i) {
    const ellipse_t ellipse = {.x_center = parameter[X_CENTER].value[i],
                               .y_center = parameter[Y_CENTER].value[i],
                               .major = parameter[MAJOR].value[i],
                               .minor = parameter[MINOR].value[i],
                               .angle = parameter[ANGLE].value[i]};
    return phaser_row(parameter[FREQUENCIES].value[i], &ellipse, parameter[DRIVE_RANGE].value[0],
                      parameter[DISPLACEMENT_RANGE].value[0]);
}

static double half_at(const double number[HALF_NUMBERS], double x, double side) {
    const ellipse_t ellipse = {
        .major = number[0], .minor = number[1], .angle = number[2], .x_center = number[3], .y_center = number[4]};
    return ellipse_arc(&ellipse, x, side);
}

typedef struct {
    double rate_hz, x_scale, y_scale;
    phaser_t phaser;
    period_tracker_t tracker;
    double turn_v; /* farthest drive since it turned last */
    bool rising;
    size_t rows, halves, length, newest; /* length: of the ring */
    double further[];                    /* rows of phaser_row_t, halves_hz, ascending, descending, ring of drives */
} state_t;

enum { ROW_NUMBERS = sizeof(phaser_row_t) / sizeof(double) };

/* Relative tolerance of a measured frequency, since those in the table were measured, too. */
static const double frequency_error = 0.01;

/* The drive turned when it came back by this part of drive_range_v. */
static const double turned = 1e-3;

static phaser_row_t *rows_of(state_t *state) {
    return (phaser_row_t *)state->further;
}

static double *halves_of(state_t *state) {
    return state->further + ROW_NUMBERS * state->rows;
}

static double *ring_of(state_t *state) {
    return halves_of(state) + (1 + 2 * HALF_NUMBERS) * state->halves;
}

static bool check_half(const parameter_t *parameter, const char *name, size_t halves, failure_t *failure) {
    if (parameter->count != HALF_NUMBERS * halves) {
        return fail(failure, "%zu numbers of %s for %zu halves_hz, there must be %d a frequency", parameter->count,
                    name, halves, HALF_NUMBERS);
    }
    for (size_t i = 0; i < halves; i++) {
        const double *number = &parameter->value[HALF_NUMBERS * i];
        if (!(number[0] >= number[1] && number[1] > 0.0)) {
            return fail(failure, "%s: ellipse %zu needs radii major >= minor > 0", name, i);
        }
    }
    return true;
}

static bool check(const parameter_t *parameter, failure_t *failure) {
    const size_t rows = parameter[FREQUENCIES].count;
    for (size_t p = MAJOR; p <= Y_CENTER; p++) {
        if (parameter[p].count != rows) {
            return fail(failure, "%zu values of %s for %zu frequencies_hz", parameter[p].count, parameters[p].name,
                        rows);
        }
    }
    if (rows == 0) {
        return fail(failure, "no frequencies_hz");
    }
    for (size_t i = 0; i < rows; i++) {
        const double angle = parameter[ANGLE].value[i];
        if (!(parameter[MAJOR].value[i] >= parameter[MINOR].value[i])) {
            return fail(failure, "major[%zu] is smaller than minor[%zu]", i, i);
        }
        if (!(angle > 0.0 && angle < M_PI_2)) {
            return fail(failure, "angle_rad[%zu] must be between 0 and pi/2: the displacement rises with the drive", i);
        }
    }
    return check_half(&parameter[ASCENDING], "ascending", parameter[HALVES].count, failure) &&
           check_half(&parameter[DESCENDING], "descending", parameter[HALVES].count, failure);
}

/* Samples that the longest lag reaches back: lag / (2 pi f) is nowhere above the largest lag at the lowest f. */
static size_t longest_lag(const parameter_t *parameter, double rate_hz) {
    double lag = 0.0;
    for (size_t i = 0; i < parameter[FREQUENCIES].count; i++) {
        lag = fmax(lag, row_of(parameter, i).column[PHASER_LAG]);
    }
    return (size_t)(lag / (2.0 * M_PI * parameter[FREQUENCIES].value[0]) * rate_hz) + 1;
}

static size_t further_bytes(const parameter_t *parameter, const stage_setup_t *setup) {
    return sizeof(double) *
           (ROW_NUMBERS * parameter[FREQUENCIES].count + (1 + 2 * HALF_NUMBERS) * parameter[HALVES].count +
            longest_lag(parameter, setup->sample_rate_hz) + 1);
}

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    state->rate_hz = setup->sample_rate_hz;
    state->x_scale = parameter[DRIVE_RANGE].value[0];
    state->y_scale = parameter[DISPLACEMENT_RANGE].value[0];
    state->rows = parameter[FREQUENCIES].count;
    state->halves = parameter[HALVES].count;
    state->length = longest_lag(parameter, setup->sample_rate_hz) + 1;
    for (size_t i = 0; i < state->rows; i++) {
        rows_of(state)[i] = row_of(parameter, i);
    }
    if (state->halves > 0) {
        double *to = halves_of(state);
        memcpy(to, parameter[HALVES].value, state->halves * sizeof(double));
        to += state->halves;
        memcpy(to, parameter[ASCENDING].value, HALF_NUMBERS * state->halves * sizeof(double));
        to += HALF_NUMBERS * state->halves;
        memcpy(to, parameter[DESCENDING].value, HALF_NUMBERS * state->halves * sizeof(double));
    }
}

/* The drive `back` samples ago, less the centre. back < length. */
static double past(state_t *state, size_t back) {
    const size_t place = back <= state->newest ? state->newest - back : state->newest + state->length - back;
    return ring_of(state)[place] - state->phaser.x_center_v;
}

/* u(t - d) - u_c. Between samples a sine of the present frequency is laid through the two neighbours. */
static double delayed(state_t *state) {
    const double samples = state->phaser.lag_s * state->rate_hz, whole = floor(samples), part = samples - whole;
    const double later = past(state, (size_t)whole), earlier = past(state, (size_t)whole + 1);
    const double angle = 2.0 * M_PI * state->phaser.frequency_hz / state->rate_hz;
    if (angle < 1e-6 || angle > M_PI_2) { /* a straight line then; fewer than four samples a period are no sine */
        return later + part * (earlier - later);
    }
    return (later * sin((1.0 - part) * angle) + earlier * sin(part * angle)) / sin(angle);
}

static double halved(state_t *state, double drive_v) {
    const double *frequency = halves_of(state);
    const double *number = frequency + state->halves + (state->rising ? 0 : HALF_NUMBERS * state->halves);
    const double x = drive_v / state->x_scale, side = state->rising ? -1.0 : 1.0;
    size_t i = 0;
    while (i + 1 < state->halves && frequency[i + 1] <= state->phaser.frequency_hz) {
        i++;
    }
    double y = half_at(number + HALF_NUMBERS * i, x, side);
    if (i + 1 < state->halves && state->phaser.frequency_hz > frequency[i]) {
        const double next = half_at(number + HALF_NUMBERS * (i + 1), x, side);
        y += (next - y) * log(state->phaser.frequency_hz / frequency[i]) / log(frequency[i + 1] / frequency[i]);
    }
    return state->y_scale * y;
}

static double output(state_t *state, double drive_v) {
    const bool halves = state->halves > 0 &&
                        state->phaser.frequency_hz <= (1.0 + frequency_error) * halves_of(state)[state->halves - 1];
    return halves ? halved(state, drive_v) : state->phaser.y_center_um + state->phaser.gain * delayed(state);
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    double *ring = ring_of(state);
    state->phaser = phaser_at(rows_of(state), state->rows, 0.0);
    for (size_t i = 0; i < state->length; i++) {
        ring[i] = signal->value;
    }
    state->tracker = (period_tracker_t){.deviation = signal->value - state->phaser.x_center_v};
    state->tracker.above = state->tracker.deviation > 0.0;
    state->turn_v = signal->value;
    state->rising = true;
    signal->value = output(state, signal->value);
}

static void follow_direction(state_t *state, double drive_v) {
    const double farther = state->rising ? drive_v - state->turn_v : state->turn_v - drive_v;
    if (farther > 0.0) {
        state->turn_v = drive_v;
    } else if (farther < -turned * state->x_scale) {
        state->turn_v = drive_v;
        state->rising = !state->rising;
    }
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double period = period_track(&state->tracker, signal->value - state->phaser.x_center_v);
    if (period > 0.0) {
        state->phaser = phaser_at(rows_of(state), state->rows, state->rate_hz / period);
    }
    state->newest = state->newest + 1 < state->length ? state->newest + 1 : 0;
    ring_of(state)[state->newest] = signal->value;
    follow_direction(state, signal->value);
    signal->value = output(state, signal->value);
}

/* The inverse phaser at one frequency: gain 1/k, and the known reference looked ahead into by d. */
static bool compile(compile_job_t *job, const parameter_t *parameter) {
    const size_t rows = parameter[FREQUENCIES].count;
    const double low = parameter[FREQUENCIES].value[0], high = parameter[FREQUENCIES].value[rows - 1];
    const double wanted_hz = compile_frequency_hz(job), frequency_hz = wanted_hz > 0.0 ? wanted_hz : low;
    if (rows > 1 && !(wanted_hz > 0.0)) {
        return fail(job->failure, "its inverse holds for one sine: give --frequency, %.6g to %.6g Hz", low, high);
    }
    if (!(frequency_hz >= (1.0 - frequency_error) * low && frequency_hz <= (1.0 + frequency_error) * high)) {
        return fail(job->failure, "nothing is known at %g Hz, only from %.6g to %.6g Hz", frequency_hz, low, high);
    }
    phaser_row_t *row = allocate(rows, sizeof *row);
    for (size_t i = 0; i < rows; i++) {
        row[i] = row_of(parameter, i);
    }
    const phaser_t phaser = phaser_at(row, rows, frequency_hz);
    free(row);
    job->delay_s += phaser.lag_s;
    compile_note(job, "ellipse: undone for a sine of %g Hz only, of the amplitude and bias it was fitted to",
                 frequency_hz);
    return compile_play_bank(job, phaser.y_center_um - phaser.gain * phaser.x_center_v, 0, &phaser.gain, NULL);
}

const block_t block_ellipse = {.name = "ellipse",
                               .place = PLACE_HYSTERESIS,
                               .order = 80,
                               .text = "the loop of a sine as an ellipse that depends on its frequency",
                               .parameter = parameters,
                               .parameters = sizeof parameters / sizeof parameters[0],
                               .check = check,
                               .state_bytes = sizeof(state_t),
                               .further_bytes = further_bytes,
                               .open = open,
                               .settle = settle,
                               .step = step,
                               .compile = compile};
