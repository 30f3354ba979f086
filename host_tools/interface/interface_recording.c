/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Recordings of hyst_interface.h. */
#include "chain/align.h"
#include "interface/handles.h"
#include "recording/import.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

recording_t *interface_recordings(const hyst_host_recording_t *const *recordings, size_t count) {
    recording_t *copies = allocate(count, sizeof *copies);
    for (size_t i = 0; i < count; i++) {
        recording_copy(&copies[i], &recordings[i]->recording, 0, recordings[i]->recording.samples);
        if (!recording_align(&copies[i], interface_failure())) {
            interface_recordings_free(copies, i + 1);
            return NULL;
        }
    }
    return copies;
}

void interface_recordings_free(recording_t *recordings, size_t count) {
    for (size_t i = 0; recordings != NULL && i < count; i++) {
        recording_free(&recordings[i]);
    }
    free(recordings);
}

static bool find_column(const char *name, column_t *column) {
    for (*column = COLUMN_DRIVE; *column < COLUMN_COUNT; (*column)++) {
        if (strcmp(name, column_name(*column)) == 0) {
            return true;
        }
    }
    char all[120] = "";
    for (column_t c = COLUMN_DRIVE; c < COLUMN_COUNT; c++) {
        const size_t used = strlen(all);
        (void)snprintf(all + used, sizeof all - used, "%s%s", used > 0 ? ", " : "", column_name(c));
    }
    return fail(interface_failure(), "a recording has no column '%s': it has %s", name, all);
}

/* Name or number of a column, as the command's option takes it. */
static bool take_column(const json_t *said, char text[24], const char **column) {
    if (json_is_integer(said)) {
        snprintf(text, 24, "%lld", (long long)json_integer_value(said));
        *column = text;
        return true;
    }
    *column = json_string_value(said);
    return *column != NULL || fail(interface_failure(), "options: a column is neither a name nor a number");
}

/* The options of an import, and what holds their texts. */
typedef struct {
    import_options_t said;
    const char *file; /* that arrays were read from, or NULL */
    json_t *json;
    char number[COLUMN_COUNT][24];
} wishes_t;

static bool take_wishes(wishes_t *wishes, const char *options) {
    json_t *columns = NULL, *scales = NULL, *said;
    const char *key;
    column_t column;
    int fill_missing = 0;
    wishes->said = import_nothing_said();
    wishes->json = interface_options(options, "{s?s, s?F, s?o, s?o, s?s, s?b}", "time", &wishes->said.time,
                                     "sample_rate_hz", &wishes->said.sample_rate_hz, "column", &columns, "scale",
                                     &scales, "file", &wishes->file, "fill_missing", &fill_missing);
    bool good = wishes->json != NULL;
    wishes->said.fill_missing = fill_missing != 0;
    json_object_foreach(columns, key, said) {
        good = good && find_column(key, &column) &&
               take_column(said, wishes->number[column], &wishes->said.column[column]);
    }
    json_object_foreach(scales, key, said) {
        good = good && find_column(key, &column);
        if (good) {
            wishes->said.scale[column] = json_number_value(said);
            good = wishes->said.scale[column] != 0.0 || fail(interface_failure(), "scale of %s: 0 or no number", key);
        }
    }
    return good;
}

hyst_host_recording_t *hyst_host_recording_read(const char *path, const char *options) {
    recording_t recording;
    wishes_t wishes = {.json = NULL};
    bool good = options == NULL
                    ? recording_read(&recording, path, interface_failure())
                    : take_wishes(&wishes, options) && import_file(&recording, path, &wishes.said, interface_failure());
    json_decref(wishes.json);
    if (good && !recording_check_keys(&recording, interface_failure())) {
        recording_free(&recording);
        good = false;
    }
    return good ? interface_recording(&recording, interface_note(NULL, 0, NULL, path)) : NULL;
}

hyst_host_recording_t *hyst_host_recording_import(const char *name, size_t samples, size_t columns,
                                                  const char *const *column, const char *const *unit,
                                                  const double *const *values, const char *options) {
    wishes_t wishes = {.json = NULL};
    table_t table;
    recording_t recording;
    import_account_t account = {0};
    provenance_note_t *note = provenance_note();
    bool good = false;
    if (take_wishes(&wishes, options)) {
        table_open(&table, name, "arrays");
        table.rows = samples;
        for (size_t i = 0; i < columns; i++) {
            double *copy = allocate(samples, sizeof(double));
            memcpy(copy, values[i], samples * sizeof(double));
            table_add(&table, column[i], unit[i], NULL, copy);
        }
        good = import_table(&recording, &table, &wishes.said, &account, interface_failure());
        table_free(&table);
        if (good) {
            recording.understood = import_account_text(&account);
        }
        if (good && wishes.file != NULL) {
            provenance_note_add_file(note, wishes.file);
        }
        import_account_free(&account);
    }
    json_decref(wishes.json);
    if (!good) {
        provenance_note_free(note);
        return NULL;
    }
    return interface_recording(&recording, note);
}

hyst_host_recording_t *hyst_host_recording_make(const char *name, double sample_rate_hz, size_t samples) {
    recording_t recording;
    if (!(sample_rate_hz > 0.0) || !(sample_rate_hz <= RECORDING_FASTEST_HZ)) {
        fail(interface_failure(), "%s: the sample rate, %g Hz, is not positive and at most %g Hz", name, sample_rate_hz,
             RECORDING_FASTEST_HZ);
        return NULL;
    }
    if (samples < 2) {
        fail(interface_failure(), "%s: the recording ends after %zu samples", name, samples);
        return NULL;
    }
    recording_create(&recording, name, sample_rate_hz, samples);
    return interface_recording(&recording, provenance_note());
}

int hyst_host_recording_set_column(hyst_host_recording_t *handle, const char *name, const double *values) {
    recording_t *recording = &handle->recording;
    column_t column;
    if (!find_column(name, &column)) {
        return 0;
    }
    for (size_t k = 0; k < recording->samples; k++) {
        if (!isfinite(values[k])) {
            return fail(interface_failure(), "%s: column '%s', sample %zu: not a finite number", recording->name, name,
                        k);
        }
        if (fabs(values[k]) > RECORDING_LARGEST) {
            return fail(interface_failure(), "%s: column '%s', sample %zu: %g is not plausible: more than %g %s",
                        recording->name, name, k, values[k], RECORDING_LARGEST, column_unit(column));
        }
    }
    memcpy(recording_add_column(recording, column), values, recording->samples * sizeof(double));
    return 1;
}

const double *hyst_host_recording_column(const hyst_host_recording_t *recording, const char *name) {
    column_t column;
    return find_column(name, &column) ? recording->recording.column[column] : NULL;
}

size_t hyst_host_recording_samples(const hyst_host_recording_t *recording) {
    return recording->recording.samples;
}

double hyst_host_recording_sample_rate_hz(const hyst_host_recording_t *recording) {
    return recording->recording.sample_rate_hz;
}

double hyst_host_recording_start_s(const hyst_host_recording_t *recording) {
    return recording->recording.start_s;
}

void hyst_host_recording_set_start_s(hyst_host_recording_t *recording, double start_s) {
    recording->recording.start_s = start_s;
}

const char *hyst_host_recording_name(const hyst_host_recording_t *recording) {
    return recording->recording.name;
}

const char *hyst_host_recording_understood(const hyst_host_recording_t *recording) {
    return recording->recording.understood != NULL ? recording->recording.understood : "";
}

char *hyst_host_recording_keys(const hyst_host_recording_t *recording) {
    json_t *keys = json_object();
    for (size_t i = 0; i < recording->recording.keys; i++) {
        json_object_set_new(keys, recording->recording.key[i].key, json_string(recording->recording.key[i].value));
    }
    return interface_text(keys);
}

int hyst_host_recording_set_key(hyst_host_recording_t *recording, const char *key, const char *value) {
    if (key[0] == '\0' || strpbrk(key, ":\r\n") != NULL || strpbrk(value, "\r\n") != NULL) {
        return fail(interface_failure(), "header key '%s': a key and its value are one line, with no colon in the key",
                    key);
    }
    if (recording_is_unit_key(key)) {
        return fail(
            interface_failure(),
            "header key '%s' says what the numbers of a file are: here they are in V, um, A or degC, at the sample "
            "rate that was given",
            key);
    }
    recording_t alone = {.name = recording->recording.name}; /* so that a value that is refused leaves the old one */
    recording_set_key(&alone, key, value);
    const bool good = recording_check_keys(&alone, interface_failure());
    alone.name = NULL;
    recording_free(&alone);
    if (good) {
        recording_set_key(&recording->recording, key, value);
    }
    return good;
}

char *hyst_host_recording_extras(const hyst_host_recording_t *recording) {
    json_t *extras = json_array();
    for (size_t i = 0; i < recording->recording.extras; i++) {
        const recording_extra_t *extra = &recording->recording.extra[i];
        const char *long_name = extra->long_name[0] != '\0' ? extra->long_name : extra->name;
        json_array_append_new(
            extras, json_pack("{s:s, s:s, s:s}", "name", extra->name, "long_name", long_name, "unit", extra->unit));
    }
    return interface_text(extras);
}

const double *hyst_host_recording_extra(const hyst_host_recording_t *recording, size_t place) {
    return place < recording->recording.extras ? recording->recording.extra[place].value : NULL;
}

hyst_host_recording_t *hyst_host_recording_aligned(const hyst_host_recording_t *recording) {
    recording_t *copy = interface_recordings(&recording, 1);
    if (copy == NULL) {
        return NULL;
    }
    hyst_host_recording_t *aligned = interface_recording(copy, interface_note(&recording, 1, NULL, NULL));
    free(copy); /* what it holds is the handle's */
    return aligned;
}

hyst_host_recording_t *hyst_host_recording_span(const hyst_host_recording_t *recording, double from_s, double to_s) {
    recording_t copy;
    recording_copy(&copy, &recording->recording, 0, recording->recording.samples);
    if (!recording_span(&copy, from_s, to_s, interface_failure())) {
        recording_free(&copy);
        return NULL;
    }
    return interface_recording(&copy, interface_note(&recording, 1, NULL, NULL));
}

int hyst_host_recording_write(const hyst_host_recording_t *recording, const char *path) {
    provenance_note_t *before = provenance_enter(recording->note);
    const bool good = recording_write(&recording->recording, path, interface_failure());
    (void)provenance_enter(before);
    return good;
}

void hyst_host_recording_free(hyst_host_recording_t *recording) {
    if (recording != NULL) {
        recording_free(&recording->recording);
        provenance_note_free(recording->note);
        free(recording);
    }
}
