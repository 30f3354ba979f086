/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *column_name(column_t column) {
    static const char *const names[COLUMN_COUNT] = {"drive",   "displacement", "reference",
                                                    "voltage", "current",      "temperature"};
    return names[column];
}

void recording_create(recording_t *recording, const char *name, double sample_rate_hz, size_t samples) {
    memset(recording, 0, sizeof *recording);
    recording->name = copy_text(name);
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

void recording_free(recording_t *recording) {
    for (size_t i = 0; i < COLUMN_COUNT; i++) {
        free(recording->column[i]);
    }
    for (size_t i = 0; i < recording->keys; i++) {
        free(recording->key[i].key);
        free(recording->key[i].value);
    }
    free(recording->key);
    free(recording->name);
    memset(recording, 0, sizeof *recording);
}

/* The shortest of 9 and 17 digits that reads back to the same number. */
static void write_number(FILE *file, double number) {
    char text[40];
    snprintf(text, sizeof text, "%.9g", number);
    if (strtod(text, NULL) != number) {
        snprintf(text, sizeof text, "%.17g", number);
    }
    fputs(text, file);
}

bool recording_write(const recording_t *recording, const char *path, failure_t *failure) {
    FILE *file = fopen(path, "w");
    bool written;
    if (file == NULL) {
        return fail(failure, "%s: %s", path, strerror(errno));
    }
    fputs("# sample_rate_hz: ", file);
    write_number(file, recording->sample_rate_hz);
    fputs("\n# drive_unit: V\n# displacement_unit: um\n", file);
    for (size_t i = 0; i < recording->keys; i++) {
        fprintf(file, "# %s: %s\n", recording->key[i].key, recording->key[i].value);
    }
    fputc('t', file);
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        if (recording->column[c] != NULL) {
            fprintf(file, ",%s", column_name(c));
        }
    }
    fputc('\n', file);
    for (size_t k = 0; k < recording->samples; k++) {
        fprintf(file, "%.9f", recording->start_s + (double)k / recording->sample_rate_hz);
        for (size_t c = 0; c < COLUMN_COUNT; c++) {
            if (recording->column[c] != NULL) {
                fputc(',', file);
                write_number(file, recording->column[c][k]);
            }
        }
        fputc('\n', file);
    }
    written = !ferror(file);
    if (fclose(file) != 0 || !written) {
        return fail(failure, "%s: could not be written: %s", path, strerror(errno));
    }
    return true;
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
