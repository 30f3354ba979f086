/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "seed_002_loops.h"
#include "twins/twin_002.h"
#include <gsl/gsl_math.h>
#include <math.h>

/* Periods from 0 V to peak_v[i] and back, one after the other, all of them `repetitions` times. */
typedef struct {
    double hz, rate_hz;
    const double *peak_v;
    size_t peaks, repetitions;
    bool for_ever; /* the twin has been at it before the recording; else it comes from rest */
} excitation_t;

static recording_t record(const excitation_t *excitation, uint64_t seed) {
    const size_t period = (size_t)lround(excitation->rate_hz / excitation->hz);
    recording_t recording;
    twin_002_t twin;
    recording_create(&recording, "twin", excitation->rate_hz, excitation->repetitions * excitation->peaks * period);
    double *drive = recording.column[COLUMN_DRIVE], *displacement = recording.column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < recording.samples; k++) {
        drive[k] = 0.5 * excitation->peak_v[k / period % excitation->peaks] *
                   (1.0 - cos(2.0 * M_PI * (double)(k % period) / (double)period));
    }
    twin_002_open(&twin, &twin_002_actuator, excitation->rate_hz, seed);
    if (excitation->for_ever) {
        twin_002_repeat(&twin, drive, excitation->peaks * period);
    }
    for (size_t k = 0; k < recording.samples; k++) {
        displacement[k] = twin_002_measure(&twin, twin_002_step(&twin, drive[k]));
    }
    return recording;
}

recording_t record_sine_002(double hz, double rate_hz, double top_v, uint64_t seed) {
    return record(&(excitation_t){hz, rate_hz, &top_v, 1, LOOPS_002_CYCLES, true}, seed);
}

recording_t record_from_rest_002(double hz, double rate_hz, double top_v, size_t periods, uint64_t seed) {
    return record(&(excitation_t){hz, rate_hz, &top_v, 1, periods, false}, seed);
}

recording_t record_reversals_002(double hz, double rate_hz, double top_v, uint64_t seed) {
    enum { PEAKS = 14 };
    double peak_v[PEAKS];
    for (size_t i = 0; i < PEAKS; i++) {
        peak_v[i] = top_v * (double)(PEAKS - i) / PEAKS;
    }
    return record(&(excitation_t){hz, rate_hz, peak_v, PEAKS, 3, true}, seed);
}

double stroke_002(const double *displacement, size_t samples) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t k = 0; k < samples; k++) {
        low = fmin(low, displacement[k]);
        high = fmax(high, displacement[k]);
    }
    return high - low;
}

line_002_t straight_line_002(const double *drive, const double *displacement, size_t samples) {
    const double n = (double)samples, percent = 100.0 / stroke_002(displacement, samples);
    double u = 0.0, y = 0.0, uu = 0.0, uy = 0.0;
    for (size_t k = 0; k < samples; k++) {
        u += drive[k] / n;
        y += displacement[k] / n;
        uu += drive[k] * drive[k] / n;
        uy += drive[k] * displacement[k] / n;
    }
    line_002_t line = {.slope = (uy - u * y) / (uu - u * u)};
    line.intercept = y - line.slope * u;
    for (size_t k = 0; k < samples; k++) {
        const double deviation = percent * fabs(displacement[k] - line.intercept - line.slope * drive[k]);
        line.maximum = fmax(line.maximum, deviation);
        line.mean += deviation / n;
    }
    return line;
}

const char *direction_002(const double *drive, const double *position, size_t period) {
    double area = 0.0;
    for (size_t k = 0; k < period; k++) {
        const size_t next = (k + 1) % period;
        area += 0.5 * (position[next] + position[k]) * (drive[next] - drive[k]);
    }
    return area > 0.0 ? "clockwise" : "counterclockwise";
}
