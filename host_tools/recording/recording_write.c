/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writing a recording: as CSV, or as HDF5 by the name of the file. */
#include "base/output_file.h"
#include "recording/recording.h"
#include "recording/recording_hdf5.h"
#include "recording/table/decimal.h"
#include <math.h>
#include <stdlib.h>

static size_t extras_written(const recording_t *recording) {
    return recording->extras < RECORDING_CSV_EXTRAS ? recording->extras : RECORDING_CSV_EXTRAS;
}

/* One header line, whatever another program has put into it. */
static void write_key(FILE *file, const char *name, const char *what, const char *value) {
    fprintf(file, "# %s%s: ", name, what);
    for (const char *at = value; *at != '\0'; at++) {
        fputc((unsigned char)*at < 0x20 || *at == 0x7F ? ' ' : *at, file);
    }
    fputc('\n', file);
}

/* Of an extra column also what is no finite number. */
static size_t write_any(char *text, double number) {
    if (isfinite(number)) {
        return decimal_write_exactly(text, number);
    }
    return (size_t)snprintf(text, DECIMAL_ROOM, "%s", isnan(number) ? "nan" : number > 0.0 ? "inf" : "-inf");
}

/* The samples as lines: a line is made in memory, and written as a whole. */
static void write_samples(const recording_t *recording, FILE *file) {
    const size_t extras = extras_written(recording);
    char *const line = allocate((COLUMN_COUNT + 1 + extras) * (DECIMAL_ROOM + 1), 1);
    for (size_t k = 0; k < recording->samples; k++) {
        size_t length = decimal_write_nano(line, recording->start_s + (double)k / recording->sample_rate_hz);
        for (size_t c = 0; c < COLUMN_COUNT; c++) {
            if (recording->column[c] != NULL) {
                line[length++] = ',';
                length += decimal_write_exactly(line + length, recording->column[c][k]);
            }
        }
        for (size_t i = 0; i < extras; i++) {
            line[length++] = ',';
            length += write_any(line + length, recording->extra[i].value[k]);
        }
        line[length++] = '\n';
        fwrite(line, 1, length, file);
    }
    free(line);
}

bool recording_write(const recording_t *recording, const char *path, failure_t *failure) {
    output_file_t output;
    if (hdf5_is_named(path)) {
        return hdf5_write_recording(recording, path, failure);
    }
    if (!output_file_open(&output, path, failure)) {
        return false;
    }
    FILE *const file = output.file;
    char rate[DECIMAL_ROOM];
    fprintf(file, "# sample_rate_hz: %.*s\n# drive_unit: V\n# displacement_unit: um\n",
            (int)decimal_write_exactly(rate, recording->sample_rate_hz), rate);
    for (size_t i = 0; i < recording->keys; i++) {
        write_key(file, recording->key[i].key, "", recording->key[i].value);
    }
    for (size_t i = 0; i < extras_written(recording); i++) {
        const recording_extra_t *extra = &recording->extra[i];
        if (extra->unit[0] != '\0') {
            write_key(file, extra->name, COLUMN_UNIT_KEY, extra->unit);
        }
        if (extra->long_name[0] != '\0') {
            write_key(file, extra->name, COLUMN_LONG_NAME_KEY, extra->long_name);
        }
    }
    fputc('t', file);
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        if (recording->column[c] != NULL) {
            fprintf(file, ",%s", column_name(c));
        }
    }
    for (size_t i = 0; i < extras_written(recording); i++) {
        fprintf(file, ",%s", recording->extra[i].name);
    }
    fputc('\n', file);
    write_samples(recording, file);
    return output_file_close(&output, true, failure);
}
