/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "samples.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nearer to an end of the range than this part of it counts as having been there. */
static const double at_the_end = 0.02;
enum { FEWEST = 24 };

bool held_out(size_t samples, size_t sample) {
    return sample * SAMPLES_TIME_BLOCKS / samples % 3 == 2;
}

static size_t first_that_counts(const model_t *model, const recording_t *recording) {
    const double *drive = recording->column[COLUMN_DRIVE];
    const size_t determined = chain_memory_determined(model, recording, recording->samples);
    double range[2], margin;
    size_t at_low = recording->samples, at_high = recording->samples, from;
    values_range(drive, recording->samples, range);
    margin = at_the_end * (range[1] - range[0]);
    for (size_t k = recording->samples; k-- > 0;) {
        at_low = drive[k] <= range[0] + margin ? k : at_low;
        at_high = drive[k] >= range[1] - margin ? k : at_high;
    }
    from = at_low > at_high ? at_low : at_high;
    from = from > determined ? from : determined;
    return recording->samples - from < recording->samples / 4 ? 0 : from;
}

bool samples_open(samples_t *samples, const model_t *model, const recording_t *recordings, size_t count,
                  failure_t *failure) {
    *samples = (samples_t){.recordings = recordings,
                           .count = count,
                           .begin = allocate(count + 1, sizeof(size_t)),
                           .from = allocate(count, sizeof(size_t))};
    for (size_t i = 0; i < count; i++) {
        samples->begin[i + 1] = samples->begin[i] + recordings[i].samples;
        samples->from[i] = first_that_counts(model, &recordings[i]);
        if (recordings[i].samples - samples->from[i] < FEWEST) {
            fail(failure, "%s: %zu samples are too few for a diagnosis", recordings[i].name, recordings[i].samples);
            samples_close(samples);
            return false;
        }
    }
    samples->all = samples->begin[count];
    samples->part = allocate(samples->all, 1);
    for (size_t i = 0; i < count; i++) {
        for (size_t k = samples->from[i] + SAMPLES_SKIPPED; k < recordings[i].samples; k++) {
            const bool held = held_out(recordings[i].samples, k);
            samples->part[samples->begin[i] + k] = held ? SAMPLE_HELD_OUT : SAMPLE_FITTED;
            *(held ? &samples->held : &samples->fitted) += 1;
        }
    }
    return true;
}

void samples_close(samples_t *samples) {
    free(samples->begin);
    free(samples->from);
    free(samples->part);
    *samples = (samples_t){0};
}

double *samples_column(const samples_t *samples) {
    return allocate(samples->all, sizeof(double));
}

void samples_residual(const samples_t *samples, const double *simulated, double *residual) {
    for (size_t i = 0; i < samples->count; i++) {
        const double *measured = samples->recordings[i].column[COLUMN_DISPLACEMENT];
        for (size_t k = 0; k < samples->recordings[i].samples; k++) {
            const size_t at = samples->begin[i] + k;
            residual[at] = k < samples->from[i] ? 0.0 : measured[k] - simulated[at];
        }
    }
}

size_t samples_pick(const samples_t *samples, samples_part_t part, const double *column, double *picked) {
    size_t count = 0;
    for (size_t k = 0; k < samples->all; k++) {
        if (samples->part[k] == part) {
            picked[count++] = column[k];
        }
    }
    return count;
}

double samples_longest_s(const samples_t *samples) {
    double longest_s = 0.0;
    for (size_t i = 0; i < samples->count; i++) {
        longest_s = fmax(longest_s, (double)samples->recordings[i].samples / samples->recordings[i].sample_rate_hz);
    }
    return longest_s;
}

double samples_square(const samples_t *samples, samples_part_t part, const double *column) {
    double sum = 0.0;
    for (size_t k = 0; k < samples->all; k++) {
        sum += samples->part[k] == part ? column[k] * column[k] : 0.0;
    }
    return sum;
}

double samples_rms(const samples_t *samples, const double *column) {
    const double used = (double)(samples->fitted + samples->held);
    double mean = 0.0, squares = 0.0;
    for (size_t k = 0; k < samples->all; k++) {
        if (samples->part[k] != SAMPLE_LEFT_OUT) {
            mean += column[k] / used;
            squares += column[k] * column[k] / used;
        }
    }
    return sqrt(fmax(0.0, squares - mean * mean));
}

bool samples_simulate(const samples_t *samples, const model_t *model, double *column, failure_t *failure) {
    for (size_t i = 0; i < samples->count; i++) {
        if (!chain_simulate(model, &samples->recordings[i], 0, column + samples->begin[i], failure)) {
            return false;
        }
    }
    return true;
}

double *samples_change(const samples_t *samples, const model_t *with, const model_t *without, failure_t *failure) {
    double *change = samples_column(samples), *less = samples_column(samples);
    const bool good =
        samples_simulate(samples, with, change, failure) && samples_simulate(samples, without, less, failure);
    for (size_t k = 0; k < samples->all; k++) {
        change[k] -= less[k];
    }
    free(less);
    if (!good) {
        free(change);
        change = NULL;
    }
    return change;
}

static double stroke_um(const recording_t *recording) {
    double range[2];
    values_range(recording->column[COLUMN_DISPLACEMENT], recording->samples, range);
    return range[1] - range[0];
}

double samples_percent(const samples_t *samples, double rms_um) {
    double worst = 0.0;
    for (size_t i = 0; i < samples->count; i++) {
        worst = fmax(worst, 100.0 * rms_um / stroke_um(&samples->recordings[i]));
    }
    return worst;
}

double samples_nrmse_percent(const samples_t *samples, samples_part_t part, const double *simulated) {
    double worst = 0.0;
    for (size_t i = 0; i < samples->count; i++) {
        const double *measured = samples->recordings[i].column[COLUMN_DISPLACEMENT];
        double squares = 0.0;
        size_t used = 0;
        for (size_t k = samples->from[i]; k < samples->recordings[i].samples; k++) {
            const size_t at = samples->begin[i] + k;
            if (samples->part[at] == part) {
                squares += (measured[k] - simulated[at]) * (measured[k] - simulated[at]);
                used++;
            }
        }
        if (used > 0) {
            worst = fmax(worst, 100.0 * sqrt(squares / (double)used) / stroke_um(&samples->recordings[i]));
        }
    }
    return worst;
}
