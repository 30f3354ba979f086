/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/samples.h"
#include "diagnosis/noise/held_out.h"
#include "numerics/reversals.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FEWEST = 24, FEWEST_OF_ALL = 600 };

/* When the drive has first been at both ends of what it covers until then. */
static size_t covered(const recording_t *recording, size_t until) {
    const double *drive = recording->column[COLUMN_DRIVE];
    size_t at_low = until, at_high = until;
    double range[2];
    values_range(drive, until, range);
    const double margin = threshold.been_at_the_end * (range[1] - range[0]);
    for (size_t k = until; k-- > 0;) {
        at_low = drive[k] <= range[0] + margin ? k : at_low;
        at_high = drive[k] >= range[1] - margin ? k : at_high;
    }
    return at_low > at_high ? at_low : at_high;
}

/* Drives before the recording (its header key drive_before_v) that were at both ends of what it covers. */
static bool covered_before(const recording_t *recording) {
    double before_v[RECORDING_MOST_BEFORE], range[2], before[2];
    size_t befores;
    failure_t ignored;
    if (!recording_drive_before(recording, before_v, &befores, &ignored) || befores == 0) {
        return false;
    }
    values_range(recording->column[COLUMN_DRIVE], recording->samples, range);
    values_range(before_v, befores, before);
    return before[0] <= range[0] && before[1] >= range[1];
}

static size_t first_that_counts(const model_t *model, const recording_t *recording, double most, bool *past_matters) {
    const size_t samples = recording->samples, determined = chain_memory_determined(model, recording, samples);
    const size_t both_ends = covered_before(recording) ? 0 : covered(recording, samples);
    const size_t known = both_ends > determined ? both_ends : determined;
    if ((double)known <= most * (double)samples) {
        return known;
    }
    *past_matters = true;
    return covered(recording, (size_t)(threshold.most_left_out * (double)samples));
}

bool samples_open(samples_t *samples, const model_t *model, const recording_t *recordings, size_t count,
                  failure_t *failure) {
    size_t take_part = 0;
    *samples = (samples_t){.recordings = recordings,
                           .count = count,
                           .begin = allocate(count + 1, sizeof(size_t)),
                           .from = allocate(count, sizeof(size_t))};
    for (size_t i = 0; i < count; i++) {
        samples->begin[i + 1] = samples->begin[i] + recordings[i].samples;
        samples->from[i] = first_that_counts(model, &recordings[i],
                                             count == 1 ? threshold.most_left_out : threshold.most_left_out_of_several,
                                             &samples->past_matters);
        if (recordings[i].samples - samples->from[i] < FEWEST) {
            fail(failure, "%s: %zu samples are too few for a diagnosis", recordings[i].name, recordings[i].samples);
            samples_close(samples);
            return false;
        }
        take_part += recordings[i].samples - samples->from[i];
    }
    if (take_part < FEWEST_OF_ALL) {
        fail(failure, "%s: %zu usable samples are too few for a diagnosis: it needs %d", recordings[0].name, take_part,
             FEWEST_OF_ALL);
        samples_close(samples);
        return false;
    }
    samples->all = samples->begin[count];
    samples->part = allocate(samples->all, 1);
    for (size_t i = 0; i < count; i++) {
        const held_out_t order = held_out_choose(&recordings[i], samples->from[i] + SAMPLES_SKIPPED);
        for (size_t k = samples->from[i] + SAMPLES_SKIPPED; k < recordings[i].samples; k++) {
            const bool held = is_held_out(&order, recordings[i].samples, k);
            if (recordings[i].masked != NULL && recordings[i].masked[k] != 0) {
                continue; /* left out: the position there is not known */
            }
            samples->part[samples->begin[i] + k] = held ? SAMPLE_HELD_OUT : SAMPLE_FITTED;
            *(held ? &samples->held : &samples->fitted) += 1;
        }
    }
    return true;
}

static void share_end(samples_t *samples, size_t i, size_t end, const double range[2]) {
    const double *drive = samples->recordings[i].column[COLUMN_DRIVE];
    unsigned char *part = samples->part + samples->begin[i];
    const held_out_t usual = held_out_usually();
    size_t there = 0, seen = 0;
    for (size_t k = 0; k < samples->recordings[i].samples; k++) {
        there += part[k] != SAMPLE_LEFT_OUT && drive_near_end(drive[k], end, range) ? 1 : 0;
    }
    for (size_t k = 0; there > 0 && k < samples->recordings[i].samples; k++) {
        if (part[k] != SAMPLE_LEFT_OUT && drive_near_end(drive[k], end, range)) {
            part[k] = is_held_out(&usual, there, seen++) ? SAMPLE_HELD_OUT : SAMPLE_FITTED;
        }
    }
}

samples_t samples_share_ends(const samples_t *samples) {
    samples_t shared = *samples;
    shared.part = allocate(samples->all, 1);
    memcpy(shared.part, samples->part, samples->all);
    for (size_t i = 0; i < samples->count; i++) {
        const size_t from = samples->from[i] + SAMPLES_SKIPPED;
        double range[2];
        values_range(samples->recordings[i].column[COLUMN_DRIVE] + from, samples->recordings[i].samples - from, range);
        share_end(&shared, i, 0, range);
        share_end(&shared, i, 1, range);
    }
    shared.fitted = shared.held = 0;
    for (size_t k = 0; k < shared.all; k++) {
        shared.fitted += shared.part[k] == SAMPLE_FITTED ? 1 : 0;
        shared.held += shared.part[k] == SAMPLE_HELD_OUT ? 1 : 0;
    }
    return shared;
}

/* Where all but a thousandth of a decay's energy is over. */
static size_t decay_end(const samples_t *samples, size_t recording, size_t from, double rate) {
    const size_t length = samples->recordings[recording].samples, over = (size_t)ceil(3.5 / rate);
    return length - from < over ? length : from + over;
}

/* Energy of decays in the samples of both parts, in parts of all of it. */
static void decays_in_parts(const samples_t *samples, size_t recording, const size_t *from, size_t count, double rate,
                            double *fitted, double *held) {
    const unsigned char *part = samples->part + samples->begin[recording];
    double all = 0.0;
    *fitted = *held = 0.0;
    for (size_t i = 0; i < count; i++) {
        const size_t end = decay_end(samples, recording, from[i], rate);
        for (size_t k = from[i]; k < end; k++) {
            const double energy = exp(-2.0 * rate * (double)(k - from[i]));
            all += energy;
            *fitted += part[k] == SAMPLE_FITTED ? energy : 0.0;
            *held += part[k] == SAMPLE_HELD_OUT ? energy : 0.0;
        }
    }
    *fitted /= all;
    *held /= all;
}

/* Includes what came after the recording's first decay. */
static void include_from(samples_t *samples, size_t recording, size_t from) {
    unsigned char *part = samples->part + samples->begin[recording];
    const recording_t *r = &samples->recordings[recording];
    for (size_t k = from; k < samples->from[recording] + SAMPLES_SKIPPED; k++) {
        const bool masked = r->masked != NULL && r->masked[k] != 0;
        samples->fitted += masked ? 0 : 1;
        part[k] = masked ? SAMPLE_LEFT_OUT : SAMPLE_FITTED;
    }
    samples->from[recording] = from - SAMPLES_SKIPPED;
    samples->past_matters = true;
}

void samples_share_decays(samples_t *samples, size_t recording, const size_t *from, size_t count, double rate) {
    unsigned char *part = samples->part + samples->begin[recording];
    const double early = 1.0 - 1.0 / HELD_OUT_EVERY, later = 1.0 / HELD_OUT_EVERY;
    double fitted, held;
    decays_in_parts(samples, recording, from, count, rate, &fitted, &held);
    if (fmin(fitted / early, held / later) >= threshold.least_share_at_rails) {
        return;
    }
    if (fitted + held < threshold.least_share_at_rails && from[0] >= SAMPLES_SKIPPED) {
        include_from(samples, recording, from[0]);
    }
    const size_t fitted_for = (size_t)ceil(-log(later) / (2.0 * rate));
    for (size_t i = 0; i < count; i++) {
        const size_t end = decay_end(samples, recording, from[i], rate);
        for (size_t k = from[i]; k < end; k++) {
            if (part[k] != SAMPLE_LEFT_OUT) {
                *(part[k] == SAMPLE_HELD_OUT ? &samples->held : &samples->fitted) -= 1;
                part[k] = k - from[i] < fitted_for ? SAMPLE_FITTED : SAMPLE_HELD_OUT;
                *(part[k] == SAMPLE_HELD_OUT ? &samples->held : &samples->fitted) += 1;
            }
        }
    }
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
        const recording_t *r = &samples->recordings[i];
        const double *measured = r->column[COLUMN_DISPLACEMENT];
        for (size_t k = 0; k < r->samples; k++) {
            const size_t at = samples->begin[i] + k;
            const bool says = k >= samples->from[i] && (r->masked == NULL || r->masked[k] == 0);
            residual[at] = says ? measured[k] - simulated[at] : 0.0;
        }
    }
}

size_t samples_reversals(const samples_t *samples, double part) {
    size_t reversals = 0;
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *r = &samples->recordings[i];
        reversals += reversals_count_by_part(r->column[COLUMN_DRIVE], r->samples, part);
    }
    return reversals;
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

size_t samples_longest(const samples_t *samples) {
    size_t longest = 0;
    for (size_t i = 1; i < samples->count; i++) {
        longest = samples->recordings[i].samples > samples->recordings[longest].samples ? i : longest;
    }
    return longest;
}

double samples_fastest_hz(const samples_t *samples) {
    return recordings_fastest_hz(samples->recordings, samples->count);
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
