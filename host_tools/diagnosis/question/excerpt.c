/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/question/excerpt.h"
#include "base/quantity.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Windows begin at each quarter of their length. */
enum { LEVELS = 8, OCTAVES = 16, STATES = LEVELS * OCTAVES, HOPS = 4 };

/* What the drive does in a stretch of samples. */
typedef struct {
    double low, high;
    unsigned char seen[STATES];
} doings_t;

static size_t smaller(size_t one, size_t other) {
    return one < other ? one : other;
}

/* Of one sample, by its level and by how far the drive has come since the last one. */
static size_t state_of(double drive_v, double last_v, const double range[2]) {
    const double width = fmax(range[1] - range[0], 1e-300), move = fabs(drive_v - last_v) / width;
    const double octave = move > 0.0 ? fmin(-log2(move), OCTAVES - 1.0) : OCTAVES - 1.0;
    const size_t level = smaller((size_t)(LEVELS * (drive_v - range[0]) / width), LEVELS - 1);
    return level * OCTAVES + (size_t)octave;
}

static void note_doings(const double *drive, size_t from, size_t to, const double range[2], doings_t *doings) {
    *doings = (doings_t){.low = drive[from], .high = drive[from]};
    for (size_t k = from; k < to; k++) {
        doings->low = fmin(doings->low, drive[k]);
        doings->high = fmax(doings->high, drive[k]);
        doings->seen[state_of(drive[k], drive[k > 0 ? k - 1 : 0], range)] = 1;
    }
}

/* How many states the windows' parts have seen together; none, if not both ends of the range. */
static size_t worth(const doings_t *part, const double range[2]) {
    const double margin = threshold.been_at_the_end * (range[1] - range[0]);
    double low = HUGE_VAL, high = -HUGE_VAL;
    size_t states = 0;
    for (size_t s = 0; s < STATES; s++) {
        unsigned char seen = 0;
        for (size_t i = 0; i < HOPS; i++) {
            seen |= part[i].seen[s];
        }
        states += seen;
    }
    for (size_t i = 0; i < HOPS; i++) {
        low = fmin(low, part[i].low);
        high = fmax(high, part[i].high);
    }
    return low <= range[0] + margin && high >= range[1] - margin ? states : 0;
}

bool excerpt_window(const recording_t *recording, size_t length, size_t *first) {
    const double *drive = recording->column[COLUMN_DRIVE];
    const size_t hop = length / HOPS, hops = recording->samples / hop;
    doings_t *doings = allocate(hops, sizeof *doings);
    double range[2];
    size_t most = 0;
    values_range(drive, recording->samples, range);
    for (size_t i = 0; i < hops; i++) {
        note_doings(drive, i * hop, (i + 1) * hop, range, &doings[i]);
    }
    for (size_t i = 0; i + HOPS <= hops; i++) {
        const size_t states = worth(&doings[i], range);
        if (states > most) {
            most = states;
            *first = smaller(i * hop, recording->samples - length);
        }
    }
    free(doings);
    return most > 0;
}

/* Means of so many values, in their place; what they leave over is given back. */
static double *mean_values(double *value, size_t rows, size_t of) {
    for (size_t k = 0; k < rows; k++) {
        double sum = 0.0;
        for (size_t i = 0; i < of; i++) {
            sum += value[k * of + i];
        }
        value[k] = sum / (double)of;
    }
    return reallocate(value, rows, sizeof *value);
}

static void mean_mask(recording_t *part, const unsigned char *masked, size_t of) {
    part->masked = allocate(part->samples, 1);
    for (size_t k = 0; k < part->samples * of; k++) {
        part->masked[k / of] |= masked[k];
    }
}

/* A mean of drives is what no converter held. */
static void become_means(recording_t *part, size_t rows, size_t of) {
    const double later_s = 0.5 * (double)(of - 1) / part->sample_rate_hz;
    unsigned char *masked = part->masked;
    part->samples = rows;
    part->sample_rate_hz /= (double)of;
    part->start_s += later_s;
    part->clock_s += part->clock_s != 0.0 ? later_s : 0.0;
    part->held = false;
    part->steps = 0;
    for (column_t column = COLUMN_DRIVE; column < COLUMN_COUNT; column++) {
        if (part->column[column] != NULL) {
            part->column[column] = mean_values(part->column[column], rows, of);
        }
    }
    for (size_t i = 0; i < part->extras; i++) {
        part->extra[i].value = mean_values(part->extra[i].value, rows, of);
    }
    if (masked != NULL) {
        mean_mask(part, masked, of);
        free(masked);
    }
}

static void copy_part(const recording_t *whole, size_t first, size_t rows, size_t of, recording_t *part) {
    recording_copy(part, whole, first, rows * of);
    if (of > 1) {
        become_means(part, rows, of);
    }
}

/* The recording becomes a part of itself. */
static void take_part(recording_t *recording, size_t first, size_t rows, size_t of) {
    recording_t *whole = allocate(1, sizeof *whole);
    *whole = *recording;
    copy_part(whole, first, rows, of, recording);
    recording->whole = whole;
}

/* The share of each recording that has more samples than that, if what the shorter ones need is left to them. */
static size_t even_share(const recording_t *recordings, size_t count, size_t most) {
    size_t share = most / count, before;
    do {
        size_t left = most, longer = 0;
        before = share;
        for (size_t i = 0; i < count; i++) {
            left -= recordings[i].samples <= share ? recordings[i].samples : 0;
            longer += recordings[i].samples > share ? 1 : 0;
        }
        share = longer > 0 ? left / longer : share;
    } while (share > before);
    return share;
}

/* Windows of all recordings with so many samples in each mean, the same number in all of them. */
static bool find_windows(const recording_t *recordings, size_t count, size_t share, size_t of, size_t *first) {
    bool good = true;
    for (size_t i = 0; good && i < count; i++) {
        first[i] = 0;
        good = recordings[i].samples <= share * of || excerpt_window(&recordings[i], share * of, &first[i]);
    }
    return good;
}

void excerpt(recording_t *recordings, size_t count, size_t most) {
    size_t all = 0, of = 1;
    for (size_t i = 0; i < count; i++) {
        all += recordings[i].samples;
    }
    if (all <= most) {
        return;
    }
    const size_t share = even_share(recordings, count, most);
    size_t *first = allocate(count, sizeof *first);
    while (!find_windows(recordings, count, share, of, first)) {
        of *= 2;
    }
    for (size_t i = 0; i < count; i++) {
        if (recordings[i].samples > share || of > 1) {
            take_part(&recordings[i], first[i], smaller(share, recordings[i].samples / of), of);
        }
    }
    free(first);
}

void excerpt_copy(const recording_t *recording, size_t most, recording_t *part) {
    size_t of = 1, first = 0;
    while (!find_windows(recording, 1, most, of, &first)) {
        of *= 2;
    }
    copy_part(recording, first, smaller(most, recording->samples / of), of, part);
}

size_t excerpt_mean_of(const recording_t *recording) {
    return recording->whole == NULL ? 1 : (size_t)(recording->whole->sample_rate_hz / recording->sample_rate_hz + 0.5);
}

bool excerpt_text(const recording_t *recording, char text[EXCERPT_LINE]) {
    const size_t of = excerpt_mean_of(recording);
    char means[EXCERPT_LINE / 2] = "";
    if (recording->whole == NULL) {
        return false;
    }
    if (of > 1) {
        snprintf(means, sizeof means, ", as means of %zu: what is quicker than %.3g s is not seen", of,
                 1.0 / recording->sample_rate_hz);
    }
    char time[2][QUANTITY_TEXT];
    for (size_t end = 0; end < 2; end++) {
        const double sample = end == 0 ? 0.0 : (double)recording->samples;
        quantity_time(time[end], recording_time(recording, sample), 1.0 / recording->sample_rate_hz);
    }
    snprintf(text, EXCERPT_LINE,
             "%zu of %zu samples, from t = %.30s to %.30s s%s. What takes longer, or happens outside, is not seen.",
             recording->samples * of, recording->whole->samples, time[0], time[1], means);
    return true;
}
