/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/recording.h"
#include "base/shown_name.h"
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    EXTRA_NAME = 100,  /* longest name of an extra column, without the number */
    EXTRA_NUMBER = 22, /* room for "_" and the number behind a name that another column has */
};

void recording_create(recording_t *recording, const char *name, double sample_rate_hz, size_t samples) {
    memset(recording, 0, sizeof *recording);
    recording->name = copy_text(shown_name(name));
    recording->sample_rate_hz = sample_rate_hz;
    recording->samples = samples;
    recording_add_column(recording, COLUMN_DRIVE);
    recording_add_column(recording, COLUMN_DISPLACEMENT);
}

double *recording_add_column(recording_t *recording, column_t column) {
    if (recording->column[column] == NULL) {
        recording->column[column] = allocate(recording->samples, sizeof(double));
    }
    return recording->column[column];
}

/* Of a name what HDF5, netCDF and Python all take: letters, digits and underscores, a letter first. To be freed. */
static char *safe_name(const char *wanted) {
    static const char prefix[] = "column_";
    char *name = allocate(sizeof prefix + strlen(wanted) + EXTRA_NUMBER, 1);
    size_t length = 0;
    if (!isalpha((unsigned char)wanted[0])) {
        length = sizeof prefix - 1;
        memcpy(name, prefix, length);
    }
    for (const char *at = wanted; *at != '\0' && length < EXTRA_NAME; at++) {
        const bool good = isalnum((unsigned char)*at) != 0;
        if (good || (length > 0 && name[length - 1] != '_')) {
            name[length++] = (char)(good ? *at : '_');
        }
    }
    while (length > 0 && name[length - 1] == '_') {
        length--;
    }
    name[length] = '\0';
    return name;
}

/* In any case of letters: other programs may not tell them apart. */
static bool is_column_name(const recording_t *recording, const char *name) {
    bool found = strcasecmp(name, "time") == 0 || strcasecmp(name, "t") == 0;
    for (column_t c = COLUMN_DRIVE; c < COLUMN_COUNT; c++) {
        found = found || strcasecmp(name, column_name(c)) == 0;
    }
    for (size_t i = 0; i < recording->extras; i++) {
        found = found || strcasecmp(name, recording->extra[i].name) == 0;
    }
    return found;
}

void recording_add_extra(recording_t *recording, const char *name, const char *long_name, const char *unit,
                         const double *value) {
    char *safe = safe_name(name);
    const size_t length = strlen(safe);
    for (size_t number = 2; is_column_name(recording, safe); number++) {
        (void)snprintf(safe + length, EXTRA_NUMBER, "_%zu", number);
    }
    recording->extra = reallocate(recording->extra, recording->extras + 1, sizeof *recording->extra);
    recording_extra_t *extra = &recording->extra[recording->extras++];
    long_name = long_name[0] != '\0' ? long_name : name;
    extra->name = safe;
    extra->long_name = copy_text(strcmp(long_name, safe) != 0 ? long_name : "");
    extra->unit = copy_text(unit);
    extra->value = allocate(recording->samples, sizeof(double));
    memcpy(extra->value, value, recording->samples * sizeof(double));
}

/* It begins so many samples later than it did. */
static void begin_later(recording_t *recording, size_t samples) {
    const double later_s = (double)samples / recording->sample_rate_hz;
    recording->start_s += later_s;
    recording->clock_s += recording->clock_s != 0.0 ? later_s : 0.0;
}

void recording_copy(recording_t *copy, const recording_t *recording, size_t first, size_t samples) {
    recording_create(copy, recording->name, recording->sample_rate_hz, samples);
    copy->start_s = recording->start_s;
    copy->clock_s = recording->clock_s;
    begin_later(copy, first);
    copy->held = recording->held;
    copy->held_since = recording->held_since;
    copy->steps = recording->steps;
    for (column_t column = COLUMN_DRIVE; column < COLUMN_COUNT; column++) {
        if (recording->column[column] != NULL) {
            memcpy(recording_add_column(copy, column), recording->column[column] + first, samples * sizeof(double));
        }
    }
    for (size_t i = 0; i < recording->extras; i++) {
        const recording_extra_t *extra = &recording->extra[i];
        recording_add_extra(copy, extra->name, extra->long_name, extra->unit, extra->value + first);
    }
    for (size_t i = 0; i < recording->keys; i++) {
        recording_set_key(copy, recording->key[i].key, recording->key[i].value);
    }
    recording_move_before(copy, recording->column[COLUMN_DRIVE], first);
    if (recording->understood != NULL) {
        copy->understood = copy_text(recording->understood);
    }
    if (recording->masked != NULL) {
        copy->masked = allocate(samples, 1);
        memcpy(copy->masked, recording->masked + first, samples);
    }
}

const char *recording_key(const recording_t *recording, const char *key) {
    for (size_t i = 0; i < recording->keys; i++) {
        if (strcmp(recording->key[i].key, key) == 0) {
            return recording->key[i].value;
        }
    }
    return NULL;
}

void recording_set_key(recording_t *recording, const char *key, const char *value) {
    for (size_t i = 0; i < recording->keys; i++) {
        if (strcmp(recording->key[i].key, key) == 0) {
            free(recording->key[i].value);
            recording->key[i].value = copy_text(value);
            return;
        }
    }
    recording->key = reallocate(recording->key, recording->keys + 1, sizeof *recording->key);
    recording->key[recording->keys].key = copy_text(key);
    recording->key[recording->keys].value = copy_text(value);
    recording->keys++;
}

void recording_mask(recording_t *recording, size_t from, size_t to) {
    double *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t samples = recording->samples;
    if (recording->masked == NULL) {
        recording->masked = allocate(samples, 1);
    }
    memset(recording->masked + from, 1, to - from);
    /* Between the nearest readings that count; a stretch that was left out before is bridged again. */
    size_t before = from, behind = to;
    while (before > 0 && recording->masked[before - 1] != 0) {
        before--;
    }
    while (behind < samples && recording->masked[behind] != 0) {
        behind++;
    }
    for (size_t k = before; k < behind; k++) {
        const double low = before > 0 ? y[before - 1] : y[behind < samples ? behind : k];
        const double high = behind < samples ? y[behind] : low;
        y[k] = low + (high - low) * (double)(k + 1 - before) / (double)(behind + 1 - before);
    }
}

void recording_keep(recording_t *recording, size_t first, size_t samples) {
    recording_move_before(recording, recording->column[COLUMN_DRIVE], first);
    for (size_t c = 0; c < COLUMN_COUNT; c++) {
        double *value = recording->column[c];
        if (value != NULL) {
            memmove(value, value + first, samples * sizeof *value);
        }
    }
    for (size_t i = 0; i < recording->extras; i++) {
        double *value = recording->extra[i].value;
        memmove(value, value + first, samples * sizeof *value);
    }
    if (recording->masked != NULL) {
        memmove(recording->masked, recording->masked + first, samples);
    }
    recording->samples = samples;
    begin_later(recording, first);
}

static void thin(double *value, size_t samples, size_t every) {
    for (size_t k = 0; value != NULL && k < samples; k++) {
        value[k] = value[k * every];
    }
}

void recording_keep_every(recording_t *recording, size_t first, size_t every) {
    const char *between = recording_key(recording, "drive_between_samples");
    recording_keep(recording, first, recording->samples - first);
    const size_t samples = (recording->samples + every - 1) / every;
    for (size_t c = 0; c < COLUMN_COUNT; c++) {
        thin(recording->column[c], samples, every);
    }
    for (size_t i = 0; i < recording->extras; i++) {
        thin(recording->extra[i].value, samples, every);
    }
    for (size_t k = 0; recording->masked != NULL && k < samples; k++) {
        recording->masked[k] = recording->masked[k * every];
    }
    if (between != NULL && strcmp(between, drive_between_name(BETWEEN_HELD)) == 0) {
        recording_set_key(recording, "drive_between_samples", drive_between_name(BETWEEN_LINE));
    }
    recording->samples = samples;
    recording->sample_rate_hz /= (double)every;
    recording->held = false;
    recording->steps = 0;
}

double recordings_fastest_hz(const recording_t *recordings, size_t count) {
    double fastest_hz = 0.0;
    for (size_t i = 0; i < count; i++) {
        fastest_hz = fmax(fastest_hz, recordings[i].sample_rate_hz);
    }
    return fastest_hz;
}

double recordings_held_s(const recording_t *recordings, size_t count) {
    double shortest_s = recording_held_s(&recordings[0]);
    for (size_t i = 1; i < count; i++) {
        shortest_s = fmin(shortest_s, recording_held_s(&recordings[i]));
    }
    return shortest_s;
}

double recording_time(const recording_t *recording, double sample) {
    return recording->start_s + sample / recording->sample_rate_hz;
}

/* The first sample at this time or later. Times in files are rounded: a millionth of a sample is none. */
static size_t sample_at(const recording_t *recording, double at_s) {
    const double at = ceil((at_s - recording->start_s) * recording->sample_rate_hz - 1e-6);
    return (size_t)fmin(fmax(at, 0.0), (double)recording->samples);
}

bool recording_span(recording_t *recording, double from_s, double to_s, failure_t *failure) {
    if (isnan(from_s) || isnan(to_s)) {
        return fail(failure, "%s: the %s of a span is not a number", recording->name,
                    isnan(from_s) ? "beginning" : "end");
    }
    const size_t first = sample_at(recording, from_s), behind = sample_at(recording, to_s);
    if (first >= behind) {
        const double end_s = recording->start_s + (double)recording->samples / recording->sample_rate_hz;
        char span[60];
        if (!isfinite(to_s)) {
            (void)snprintf(span, sizeof span, "from %g s on", from_s);
        } else if (!isfinite(from_s)) {
            (void)snprintf(span, sizeof span, "before %g s", to_s);
        } else {
            (void)snprintf(span, sizeof span, "from %g to %g s", from_s, to_s);
        }
        return fail(failure, "%s: no sample %s: it was recorded from %g to %g s", recording->name, span,
                    recording->start_s, end_s);
    }
    recording_keep(recording, first, behind - first);
    return true;
}

static void free_alone(recording_t *recording) {
    for (size_t i = 0; i < COLUMN_COUNT; i++) {
        free(recording->column[i]);
    }
    for (size_t i = 0; i < recording->extras; i++) {
        free(recording->extra[i].name);
        free(recording->extra[i].long_name);
        free(recording->extra[i].unit);
        free(recording->extra[i].value);
    }
    free(recording->extra);
    for (size_t i = 0; i < recording->keys; i++) {
        free(recording->key[i].key);
        free(recording->key[i].value);
    }
    free(recording->key);
    free(recording->name);
    free(recording->understood);
    free(recording->masked);
    memset(recording, 0, sizeof *recording);
}

/* What is whole is no part of another one. */
void recording_free(recording_t *recording) {
    if (recording->whole != NULL) {
        free_alone(recording->whole);
        free(recording->whole);
    }
    free_alone(recording);
}

void values_range(const double *values, size_t count, double range[2]) {
    range[0] = range[1] = values[0];
    for (size_t k = 1; k < count; k++) {
        range[0] = fmin(range[0], values[k]);
        range[1] = fmax(range[1], values[k]);
    }
}

void recordings_range(const recording_t *recordings, size_t count, column_t column, double range[2]) {
    values_range(recordings[0].column[column], recordings[0].samples, range);
    for (size_t i = 1; i < count; i++) {
        double one[2];
        values_range(recordings[i].column[column], recordings[i].samples, one);
        range[0] = fmin(range[0], one[0]);
        range[1] = fmax(range[1], one[1]);
    }
}

double **recordings_room(const recording_t *recordings, size_t count) {
    double **room = allocate(count, sizeof *room);
    for (size_t i = 0; i < count; i++) {
        room[i] = allocate(recordings[i].samples, sizeof(double));
    }
    return room;
}

void recordings_room_free(double **room, size_t count) {
    for (size_t i = 0; i < count; i++) {
        free(room[i]);
    }
    free(room);
}
