/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writing a recording: as CSV, or as HDF5 by the name of the file. */
#include "base/output_file.h"
#include "recording/decimal.h"
#include "recording/recording.h"
#include "recording/recording_hdf5.h"

/* The samples as lines: a line is made in memory, and written as a whole. */
static void write_samples(const recording_t *recording, FILE *file) {
    char line[(COLUMN_COUNT + 1) * (DECIMAL_ROOM + 1)];
    for (size_t k = 0; k < recording->samples; k++) {
        size_t length = decimal_write_nano(line, recording->start_s + (double)k / recording->sample_rate_hz);
        for (size_t c = 0; c < COLUMN_COUNT; c++) {
            if (recording->column[c] != NULL) {
                line[length++] = ',';
                length += decimal_write_exactly(line + length, recording->column[c][k]);
            }
        }
        line[length++] = '\n';
        fwrite(line, 1, length, file);
    }
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
        fprintf(file, "# %s: %s\n", recording->key[i].key, recording->key[i].value);
    }
    fputc('t', file);
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        if (recording->column[c] != NULL) {
            fprintf(file, ",%s", column_name(c));
        }
    }
    fputc('\n', file);
    write_samples(recording, file);
    return output_file_close(&output, true, failure);
}
