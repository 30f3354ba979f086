/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/held_readings.h"
#include "look/signal/numbers.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_sort.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The most frequent of count values below `limit`. */
static size_t most_frequent(const size_t *value, size_t count, size_t limit) {
    size_t *times = allocate(limit, sizeof *times), best = 0;
    for (size_t i = 0; i < count; i++) {
        times[value[i]]++;
        best = times[value[i]] > times[best] ? value[i] : best;
    }
    free(times);
    return best;
}

/* Rows from each change of the reading to the next. at: rows of the changes. Returns how many changes there are. */
static size_t find_changes(const double *y, size_t samples, size_t *at, size_t *apart) {
    size_t changes = 0;
    for (size_t k = 1; k < samples; k++) {
        if (y[k] != y[k - 1]) {
            at[changes] = k;
            if (changes > 0) {
                apart[changes - 1] = k - at[changes - 1];
            }
            changes++;
        }
    }
    return changes;
}

static size_t at_multiples(const size_t *apart, size_t count, size_t rows) {
    size_t multiples = 0;
    for (size_t i = 0; i < count; i++) {
        multiples += apart[i] % rows == 0 ? 1 : 0;
    }
    return multiples;
}

/* All values there are, each once, in their order. Returns how many. */
static size_t find_levels(const double *y, size_t samples, double *level) {
    size_t levels = 1;
    memcpy(level, y, samples * sizeof *level);
    gsl_sort(level, 1, samples);
    for (size_t i = 1; i < samples; i++) {
        if (level[i] != level[levels - 1]) {
            level[levels++] = level[i];
        }
    }
    return levels;
}

static size_t level_of(const double *level, size_t levels, double value) {
    size_t low = 0, high = levels;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (level[middle] <= value) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Whether the drive rests in the rows up to one, or moves in more than one of them. */
static bool rests_or_goes_on(const double *u, size_t to, size_t rows) {
    double way = 0.0, largest = 0.0;
    for (size_t k = to + 1 - rows; k <= to; k++) {
        way += fabs(u[k] - u[k - 1]);
        largest = fmax(largest, fabs(u[k] - u[k - 1]));
    }
    return way - largest >= threshold.way_beside_largest * largest;
}

/* Counts the changes that fresh readings would have shown in pieces. */
static void count_changes(const recording_t *recording, const size_t *at, const size_t *apart, size_t count,
                          held_readings_t *held) {
    const double *y = recording->column[COLUMN_DISPLACEMENT], *u = recording->column[COLUMN_DRIVE];
    double *level = allocate(recording->samples, sizeof *level), all = 0.0;
    const size_t levels = find_levels(y, recording->samples, level);
    for (size_t i = 0; i < count; i++) {
        const size_t k = at[i + 1], before = level_of(level, levels, y[k - 1]), after = level_of(level, levels, y[k]);
        const size_t between = before > after ? before - after : after - before;
        if (between > 1 && k >= held->rows && rests_or_goes_on(u, k, held->rows)) {
            all += 1.0;
            held->changes += apart[i] % held->rows == 0 ? 1.0 : 0.0;
        }
    }
    free(level);
    if (all > 0.0) {
        held->log_chance =
            look_log_chance_binomial(held->changes, all, 1.0 / (double)held->rows, (double)recording->samples);
    }
}

void held_readings_find(const recording_t *recording, held_readings_t *held) {
    const size_t samples = recording->samples;
    size_t *at = allocate(2 * samples, sizeof *at), *apart = at + samples;
    const size_t changes = find_changes(recording->column[COLUMN_DISPLACEMENT], samples, at, apart);
    const size_t count = changes > 0 ? changes - 1 : 0, rows = count > 0 ? most_frequent(apart, count, samples) : 0;
    memset(held, 0, sizeof *held);
    if (rows > 1 && (double)at_multiples(apart, count, rows) >= threshold.held_at_multiples * (double)count) {
        held->rows = rows;
        held->rate_hz = recording->sample_rate_hz / (double)rows;
        count_changes(recording, at, apart, count, held);
        for (size_t i = 0; i < changes; i++) {
            at[i] %= rows;
        }
        held->first = most_frequent(at, changes, rows);
    }
    if (!(held->log_chance < look_log_chance_limit())) {
        memset(held, 0, sizeof *held);
    }
    free(at);
}

fault_t *held_readings_add(fault_list_t *faults, size_t recording, const held_readings_t *held) {
    fault_t *fault =
        held->rows == 0 ? NULL : fault_add(faults, &fault_held_readings, recording, held->changes, held->log_chance);
    if (fault != NULL) {
        fault_number(fault, "rows_per_reading", "1", (double)held->rows, 0.0);
        fault_number(fault, "sensor_rate_hz", "Hz", held->rate_hz, 0.0);
    }
    return fault;
}

bool held_readings_undo(recording_t *recordings, size_t count, const held_readings_t *held) {
    bool good = true;
    for (size_t i = 0; i < count; i++) {
        good = good && recordings[i].samples >= LOOK_LEAST_SAMPLES * (held[i].rows + 1);
    }
    for (size_t i = 0; good && i < count; i++) {
        if (held[i].rows > 0) {
            recording_keep_every(&recordings[i], held[i].first, held[i].rows);
        }
    }
    return good;
}
