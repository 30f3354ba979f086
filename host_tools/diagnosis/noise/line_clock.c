/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/line_clock.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>

static const double mains_hz[] = {50.0, 60.0};

static bool is_mains(double hz) {
    for (size_t i = 0; i < sizeof mains_hz / sizeof mains_hz[0]; i++) {
        const double multiple = round(hz / mains_hz[i]);
        if (multiple >= 1.0 && fabs(hz / (multiple * mains_hz[i]) - 1.0) < threshold.mains_within) {
            return true;
        }
    }
    return false;
}

static double choose(const double *line_hz, size_t lines) {
    for (size_t i = 0; i < lines; i++) {
        if (is_mains(line_hz[i])) {
            return line_hz[i];
        }
    }
    return line_hz[0];
}

/* Phase of a line when a recording begins, as a part of its samples has it; by second differences: what is slow is
 * large, and leaves its trace at all frequencies. */
static double phase_of(const samples_t *samples, const double *residual, size_t i, size_t from, size_t to, double hz) {
    const double turn = 2.0 * M_PI * hz / samples->recordings[i].sample_rate_hz;
    const double *x = residual + samples->begin[i];
    const unsigned char *part = samples->part + samples->begin[i];
    double in_phase = 0.0, ahead = 0.0;
    for (size_t k = from + 1; k + 1 < to; k++) {
        if (part[k - 1] == SAMPLE_FITTED && part[k] == SAMPLE_FITTED && part[k + 1] == SAMPLE_FITTED) {
            const double bend = 2.0 * x[k] - x[k - 1] - x[k + 1];
            in_phase += bend * sin(turn * (double)k);
            ahead += bend * cos(turn * (double)k);
        }
    }
    return atan2(ahead, in_phase);
}

/* A line between two bins of a spectrum: by the phase that it gains from one half of the longest recording to the
 * other. What is left of its error would be taken for another phase in a recording of another length. */
static double sharpen(const samples_t *samples, const double *residual, double hz) {
    const size_t longest = samples_longest(samples);
    const size_t from = samples->from[longest], to = samples->recordings[longest].samples, middle = (from + to) / 2;
    const double half_s = (double)(middle - from) / samples->recordings[longest].sample_rate_hz;
    const double gained =
        phase_of(samples, residual, longest, middle, to, hz) - phase_of(samples, residual, longest, from, middle, hz);
    return hz + remainder(gained / (2.0 * M_PI), 1.0) / half_s;
}

void line_clock_set(recording_t *recordings, const samples_t *samples, const double *residual, const double *line_hz,
                    size_t lines) {
    if (lines == 0) {
        return;
    }
    const double hz = sharpen(samples, residual, choose(line_hz, lines));
    double first = 0.0;
    for (size_t i = 0; i < samples->count; i++) {
        const double phase = phase_of(samples, residual, i, 0, samples->recordings[i].samples, hz);
        first = i == 0 ? phase : first;
        const double turns = (phase - first) / (2.0 * M_PI);
        recordings[i].clock_s = (turns - floor(turns)) / hz;
    }
}
