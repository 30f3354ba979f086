/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/signal/drive.h"
#include "look/signal/period.h"
#include "look/signal/resolution.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* LEAST_WAY: intervals of a way whose inside, without the first and the last one, tells a line from a sine. */
enum { STEP_SURROUNDING = 4, NOISE_BLOCK = 32, LEAST_WAY = 4 };
/* The median of chi square with some 9 independent squares is 7 % below its mean. */
static const double median_of_block = 0.93;
/* Median of the square of a normal number, of its mean. */
static const double median_of_square = 0.455;

const char *drive_kind_text(drive_kind_t kind) {
    static const char *const texts[] = {"never moves",
                                        "jumps and rests",
                                        "is one sine over and over",
                                        "is a sine whose amplitude or mean changes",
                                        "is a triangle over and over",
                                        "goes in straight lines",
                                        "repeats itself, with several frequencies",
                                        "sweeps through frequencies",
                                        "has many frequencies and repeats nothing"};
    return texts[kind];
}

const char *drive_kind_name(drive_kind_t kind) {
    static const char *const names[] = {"rest",  "steps",    "sine",  "swelling sine", "triangle",
                                        "lines", "periodic", "sweep", "random"};
    return names[kind];
}

size_t drive_periods(const drive_look_t *drive) {
    return drive->period > 0.0 ? (size_t)((double)span_length(drive->repeat) / drive->period + 1e-6) : 0;
}

size_t drive_unsettled_passes(const drive_look_t *drive) {
    return drive_periods(drive) > 2 ? 1 : 0;
}

/* Variances of second and third differences in a block, as they would be of white noise; usual: by the second ones'
 * median. */
static void block_variances(const double *u, double *second, double *third, double *usual) {
    double square[NOISE_BLOCK - 3];
    *second = *third = 0.0;
    for (size_t k = 0; k + 3 < NOISE_BLOCK; k++) {
        const double a = u[k] - 2.0 * u[k + 1] + u[k + 2], b = u[k + 1] - 2.0 * u[k + 2] + u[k + 3];
        square[k] = a * a / 6.0;
        *second += square[k];
        *third += (b - a) * (b - a) / 20.0;
    }
    *usual = look_quantile(square, NOISE_BLOCK - 3, 0.5) * (NOISE_BLOCK - 3) / median_of_square;
}

/* Noise in the blocks in which the drive's differences are those of a white series, if enough of them are. */
static double noise_of_drive(const double *u, size_t samples, double range_v, double step_v) {
    const size_t blocks = samples / NOISE_BLOCK;
    double *white = allocate(blocks + 1, sizeof *white), noise_v = 0.0;
    size_t used = 0;
    for (size_t b = 0; b < blocks; b++) {
        double second, third, usual;
        block_variances(u + b * NOISE_BLOCK, &second, &third, &usual);
        /* A corner among straight lines has the ratio of noise, too, but noise is in all samples. */
        if (third > threshold.white_ratio_low * second && third < threshold.white_ratio_high * second &&
            usual > threshold.white_everywhere * second) {
            white[used++] = third;
        }
    }
    if (blocks >= 8 && range_v > 0.0 && (double)used >= threshold.white_blocks * (double)blocks) {
        noise_v = sqrt(look_quantile(white, used, 0.5) / (NOISE_BLOCK - 3) / median_of_block);
        if (noise_v < threshold.noise_beyond_step * step_v || noise_v < threshold.noise_least * range_v ||
            noise_v > threshold.most_noise_of_drive * range_v) {
            noise_v = 0.0;
        }
    }
    free(white);
    return noise_v;
}

/* Fewer equal values than these are no rest. */
static size_t least_rest(double rate_hz) {
    return (size_t)fmax(threshold.rest_of_equal_samples, threshold.rest_of_equal_s * rate_hz);
}

/* How long values stay as they are, most often: 1, or the samples for which a slow converter holds. */
static size_t held_for(const double *u, size_t samples, double rate_hz) {
    const size_t longest = least_rest(rate_hz), most = longest < samples ? longest : samples; /* of a run */
    size_t *count = allocate(most, sizeof *count), run = 1, all = 0, best = 1;
    for (size_t k = 1; k < samples; k++) {
        if (u[k] == u[k - 1]) {
            run++;
        } else {
            if (run < most) {
                count[run]++;
                all++;
            }
            run = 1;
        }
    }
    for (size_t r = 2; r < most; r++) {
        best = count[r] > count[best] ? r : best;
    }
    const size_t times = count[best];
    free(count);
    return all >= 8 && (double)times > threshold.held_part * (double)all ? best : 1;
}

static void find_rests(const double *u, size_t samples, double rate_hz, drive_look_t *drive) {
    const double within = 2.0 * threshold.edge_of_noise * drive->noise_v;
    const size_t least =
        (size_t)fmax((double)least_rest(rate_hz), threshold.held_in_a_rest * (double)drive->held_samples);
    size_t from = 0;
    double low = u[0], high = u[0];
    for (size_t k = 1; k <= samples; k++) {
        if (k < samples && fmax(high, u[k]) - fmin(low, u[k]) <= within) {
            low = fmin(low, u[k]);
            high = fmax(high, u[k]);
            continue;
        }
        if (k - from >= least) {
            drive->rest = reallocate(drive->rest, drive->rests + 1, sizeof *drive->rest);
            drive->rest[drive->rests++] = (look_span_t){from, k};
            drive->rest_s += (double)(k - from) / rate_hz;
        }
        if (k < samples) {
            from = k;
            low = high = u[k];
        }
    }
}

/* held: samples for which the converter holds each value. Its next change is so far away. */
static double largest_around(const double *u, size_t samples, size_t k, size_t held) {
    const size_t surrounding = STEP_SURROUNDING * held;
    const size_t from = k > surrounding ? k - surrounding : 1;
    const size_t to = k + surrounding < samples ? k + surrounding + 1 : samples;
    double largest = 0.0;
    for (size_t i = from; i < to; i++) {
        largest = i != k ? fmax(largest, fabs(u[i] - u[i - 1])) : largest;
    }
    return largest;
}

static void find_steps(const double *u, size_t samples, drive_look_t *drive) {
    const double range_v = drive->range_v[1] - drive->range_v[0];
    for (size_t k = 1; k < samples; k++) {
        const double change = fabs(u[k] - u[k - 1]);
        if (change >= threshold.step_part * range_v && change > 4.0 * threshold.edge_of_noise * drive->noise_v &&
            change >= threshold.step_stands_out * largest_around(u, samples, k, drive->held_samples)) {
            drive->step = reallocate(drive->step, drive->steps + 1, sizeof *drive->step);
            drive->step[drive->steps++] = k;
        }
    }
    if (drive->held_samples > 1 && drive->rests == 0) { /* each new value is one */
        drive->steps = 0;
    }
}

static size_t count_levels(const double *u, const drive_look_t *drive) {
    const double same = 1e-6 * (drive->range_v[1] - drive->range_v[0]) + threshold.edge_of_noise * drive->noise_v;
    size_t levels = 0;
    for (size_t r = 0; r < drive->rests; r++) {
        size_t before = 0;
        while (before < r && fabs(u[drive->rest[before].from] - u[drive->rest[r].from]) > same) {
            before++;
        }
        levels += before == r ? 1 : 0;
    }
    return levels;
}

/* Where all of the power but a part at either end lies. */
static void find_frequencies(const double *u, size_t samples, double rate_hz, double frequency_hz[2]) {
    const size_t length = look_smooth_length(samples);
    double *value = allocate(length, sizeof *value), *spectrum = allocate(length + 2, sizeof *spectrum);
    const double mean = look_mean(u, length);
    double all = 0.0, sum = 0.0;
    for (size_t k = 0; k < length; k++) { /* Hann's window: a drive that does not end where it began has no edge */
        value[k] = (u[k] - mean) * (1.0 - cos(2.0 * M_PI * ((double)k + 0.5) / (double)length));
    }
    look_transform(value, length, spectrum);
    for (size_t h = 1; h <= length / 2; h++) {
        all += spectrum[2 * h] * spectrum[2 * h] + spectrum[2 * h + 1] * spectrum[2 * h + 1];
    }
    frequency_hz[0] = frequency_hz[1] = 0.0;
    for (size_t h = 1; h <= length / 2 && all > 0.0; h++) {
        const double f = (double)h * rate_hz / (double)length;
        sum += spectrum[2 * h] * spectrum[2 * h] + spectrum[2 * h + 1] * spectrum[2 * h + 1];
        frequency_hz[0] = sum <= threshold.edge_of_power * all ? f : frequency_hz[0];
        frequency_hz[1] = sum <= (1.0 - threshold.edge_of_power) * all ? f : frequency_hz[1];
    }
    frequency_hz[0] = fmax(frequency_hz[0], rate_hz / (double)length);
    frequency_hz[1] = fmax(frequency_hz[1], frequency_hz[0]);
    free(value);
    free(spectrum);
}

/* Largest distance from the chord. */
static double bend_of(const double *u, size_t from, size_t to) {
    double worst = 0.0;
    for (size_t k = from; k < to; k++) {
        const double chord = u[from] + (u[to] - u[from]) * (double)(k - from) / (double)(to - from);
        worst = fmax(worst, fabs(u[k] - chord));
    }
    return worst;
}

/* Corners between samples cut the ends of a way, by the more the fewer samples it has. So its inside has to be straight
 * by itself: a sine of few samples is as near to its chord as a triangle. rounding_v: of each sample. */
static bool is_line(const double *u, size_t from, size_t to, double rounding_v) {
    const double height = fabs(u[to] - u[from]), sample = threshold.cut_corner * height / (double)(to - from);
    return bend_of(u, from, to) <= height * threshold.bent_way + 2.0 * sample &&
           bend_of(u, from + 1, to - 1) <= height * threshold.bent_way + rounding_v;
}

/* Whether the drive is a straight line between most of its turning points, or from end to end without any; rests and
 * steps are lines, too. */
static bool goes_in_lines(const double *u, size_t samples, const drive_look_t *drive, const reversals_t *turns) {
    const double rounding_v = drive->step_v + 2.0 * threshold.edge_of_noise * drive->noise_v;
    size_t straight = 0, ways = 0;
    for (size_t i = 1; i < turns->count; i++) {
        if (turns->at[i] - turns->at[i - 1] >= LEAST_WAY) { /* a shorter one may be anything */
            straight += is_line(u, turns->at[i - 1], turns->at[i], rounding_v) ? 1 : 0;
            ways++;
        }
    }
    return turns->count == 0 ? is_line(u, 0, samples - 1, rounding_v)
                             : ways >= 2 && (double)straight >= threshold.straight_ways * (double)ways;
}

/* Whether one sine of its period leaves nearly nothing of a drive that repeats itself. The line of a triangle has so
 * much of its power that a count of lines does not tell. */
static bool is_one_sine(const double *u, const drive_look_t *drive) {
    const size_t all = span_length(drive->repeat), count = (size_t)fmin((double)all, ceil(2.0 * drive->period));
    double *columns = allocate(3 * count, sizeof *columns);
    const double *const column[] = {columns, columns + count, columns + 2 * count};
    look_regression_t fit;
    for (size_t k = 0; k < count; k++) {
        const double phase = 2.0 * M_PI * (double)k / drive->period;
        columns[k] = 1.0;
        columns[count + k] = cos(phase);
        columns[2 * count + k] = sin(phase);
    }
    const double allowed = threshold.sine_leaves * (drive->range_v[1] - drive->range_v[0]);
    const bool one =
        look_regress(column, 3, u + drive->repeat.from, NULL, count, &fit) && fit.rms < hypot(allowed, drive->noise_v);
    free(columns);
    return one;
}

/* Mean durations of a few ways each, without overlap: one way alone is whole samples, of which a fast one has few.
 * Returns how many. */
static size_t durations_of(const reversals_t *turns, size_t few, size_t most, double *duration) {
    const size_t all = (turns->count - 1) / few, used = all < most ? all : most;
    for (size_t i = 0; i < used; i++) {
        const size_t at = i * all / used * few;
        duration[i] = (double)(turns->at[at + few] - turns->at[at]) / (double)few;
    }
    return used;
}

/* Rank correlation of the ways' durations with time. */
static double trend_of(const double *value, size_t count) {
    double concordant = 0.0;
    for (size_t i = 0; i < count; i++) {
        for (size_t j = i + 1; j < count; j++) {
            concordant += value[j] > value[i] ? 1.0 : value[j] < value[i] ? -1.0 : 0.0;
        }
    }
    return concordant / (0.5 * (double)count * ((double)count - 1.0));
}

static drive_kind_t kind_without_period(const double *u, const drive_look_t *drive, size_t samples, double rate_hz,
                                        const reversals_t *turns) {
    enum { MOST_WAYS = 400, FEW_WAYS = 8 };
    const size_t ways = turns->count > 0 ? turns->count - 1 : 0;
    drive_kind_t kind = DRIVE_RANDOM;
    if (drive->steps > 0 && drive->rest_s * rate_hz > threshold.most_of_recording * (double)samples) {
        return DRIVE_STEPS;
    }
    if (goes_in_lines(u, samples, drive, turns)) {
        return DRIVE_LINES;
    }
    if ((double)ways >= threshold.fewest_ways) {
        double *duration = allocate(MOST_WAYS, sizeof *duration);
        const size_t alone = durations_of(turns, 1, MOST_WAYS, duration);
        const double middle = look_quantile(duration, alone, 0.5), spread = look_robust_deviation(duration, alone);
        const size_t means = durations_of(turns, ways < FEW_WAYS * FEW_WAYS ? 1 : FEW_WAYS, MOST_WAYS, duration);
        if (fabs(trend_of(duration, means)) > threshold.sweeps) {
            kind = DRIVE_SWEEP;
        } else if (spread < threshold.same_duration * middle + 1.0) {
            kind = DRIVE_SWELLING;
        }
        free(duration);
    }
    return kind;
}

static drive_kind_t kind_of(const double *u, const drive_look_t *drive, size_t samples, double rate_hz) {
    reversals_t turns;
    drive_kind_t kind;
    if (!(drive->range_v[1] - drive->range_v[0] > 4.0 * threshold.edge_of_noise * drive->noise_v)) {
        return DRIVE_RESTS;
    }
    const double least_v = threshold.reversal * (drive->range_v[1] - drive->range_v[0]);
    reversals_find(u, samples, least_v, &turns);
    if (drive->period > 0.0 && (double)span_length(drive->repeat) > threshold.most_of_recording * (double)samples) {
        reversals_t repeated;
        reversals_find(u + drive->repeat.from, span_length(drive->repeat), least_v, &repeated);
        kind = drive->steps > 0 && drive->rest_s * rate_hz > threshold.most_of_recording * (double)samples ? DRIVE_STEPS
               : is_one_sine(u, drive)                                                                     ? DRIVE_SINE
               : goes_in_lines(u + drive->repeat.from, span_length(drive->repeat), drive, &repeated) ? DRIVE_TRIANGLE
               : drive->harmonics < threshold.one_line                                               ? DRIVE_SINE
                                                                                                     : DRIVE_PERIODIC;
        reversals_free(&repeated);
    } else {
        kind = kind_without_period(u, drive, samples, rate_hz, &turns);
    }
    reversals_free(&turns);
    return kind;
}

/* Error of the value halfway between two samples from a cubic through four, seen on every second sample, in parts of
 * the range: where it is small, what the drive does between samples makes less difference than that. */
static double curve_error(const double *u, size_t samples, double range_v) {
    double *error = allocate(samples, sizeof *error);
    double worst = HUGE_VAL;
    if (samples > 16 && range_v > 0.0) {
        for (size_t k = 3; k + 3 < samples; k++) {
            error[k] = fabs(u[k] - (9.0 * (u[k - 1] + u[k + 1]) - u[k - 3] - u[k + 3]) / 16.0) / range_v;
        }
        worst = look_quantile(error + 3, samples - 6, 0.999);
    }
    free(error);
    return worst;
}

static bool find_between(const recording_t *recording, drive_look_t *drive, failure_t *failure) {
    const double *u = recording->column[COLUMN_DRIVE];
    if (!recording_drive_between(recording, &drive->between, failure)) {
        return false;
    }
    drive->between_given = drive->between != BETWEEN_UNKNOWN;
    if (drive->between_given) {
        return true;
    }
    if (drive->held_samples > 1 || drive->kind == DRIVE_STEPS) {
        drive->between = BETWEEN_HELD;
    } else if (curve_error(u, recording->samples, drive->range_v[1] - drive->range_v[0]) < threshold.smooth_drive) {
        drive->between = BETWEEN_SMOOTH;
    } else if (drive->kind == DRIVE_TRIANGLE || drive->kind == DRIVE_LINES) {
        drive->between = BETWEEN_LINE;
    }
    return true;
}

bool drive_look(const recording_t *recording, drive_look_t *drive, failure_t *failure) {
    const double *u = recording->column[COLUMN_DRIVE];
    const size_t samples = recording->samples;
    const double rate_hz = recording->sample_rate_hz;
    memset(drive, 0, sizeof *drive);
    values_range(u, samples, drive->range_v);
    const double range_v = drive->range_v[1] - drive->range_v[0], digit = resolution_digit(u, samples);
    drive->step_v = fmax(resolution_step(u, samples), digit);
    drive->held_samples = held_for(u, samples, rate_hz);
    /* Noise would let no value come again, and a staircase looks like noise. */
    drive->noise_v = drive->held_samples > 1 ? 0.0 : noise_of_drive(u, samples, range_v, drive->step_v);
    find_rests(u, samples, rate_hz, drive);
    find_steps(u, samples, drive);
    drive->levels = count_levels(u, drive);
    period_find(u, samples, drive);
    find_frequencies(u, samples, rate_hz, drive->frequency_hz);
    drive->kind = kind_of(u, drive, samples, rate_hz);
    if (!find_between(recording, drive, failure)) {
        drive_look_free(drive);
        return false;
    }
    return true;
}

void drive_look_free(drive_look_t *drive) {
    free(drive->rest);
    free(drive->step);
    memset(drive, 0, sizeof *drive);
}
