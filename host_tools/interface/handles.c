/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/handles.h"
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static _Thread_local failure_t last;

failure_t *interface_failure(void) {
    return &last;
}

unsigned hyst_host_interface_version(void) {
    return 1;
}

const char *hyst_host_version(void) {
    return HYST_VERSION;
}

const char *hyst_host_error(void) {
    return last.text;
}

void hyst_host_free(void *memory) {
    free(memory);
}

/* An option that is there has been given: 0 would be taken for its absence, and a negative count for 0. */
static bool check_positive(json_t *json) {
    static const char *const keys[] = {"sample_rate_hz", "operators", "cycles", "steps", "tones"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        const json_t *value = json_object_get(json, keys[i]);
        if (json_is_number(value) && !(json_number_value(value) > 0.0)) {
            return fail(&last, "%s %g: must be positive", keys[i], json_number_value(value));
        }
    }
    return true;
}

/* The only arrays among options: the first end below the other, as on the command line. */
static bool check_ranges(json_t *json) {
    const char *key;
    json_t *value;
    json_object_foreach(json, key, value) {
        const double low = json_number_value(json_array_get(value, 0)),
                     high = json_number_value(json_array_get(value, 1));
        if (json_is_array(value) && !(low < high)) {
            return fail(&last, "%s: from %g to %g is no range: the lower end comes first", key, low, high);
        }
    }
    return true;
}

json_t *interface_options(const char *options, const char *format, ...) {
    json_error_t error;
    va_list values;
    json_t *json = json_loads(options != NULL ? options : "{}", JSON_REJECT_DUPLICATES, &error);
    if (!json_is_object(json)) {
        fail(&last, "options: %s", json == NULL ? error.text : "not an object");
        json_decref(json);
        return NULL;
    }
    va_start(values, format);
    const bool good = json_vunpack_ex(json, &error, JSON_STRICT, format, values) == 0;
    va_end(values);
    if (!good) {
        fail(&last, "options: %s", error.text);
    }
    if (!good || !check_ranges(json) || !check_positive(json)) {
        json_decref(json);
        return NULL;
    }
    return json;
}

char *interface_text(json_t *json) {
    char *text = json_dumps(json, JSON_ENCODE_ANY);
    json_decref(json);
    if (text == NULL) {
        fail(&last, "the answer cannot be written as JSON");
    }
    return text;
}

provenance_note_t *interface_note(const hyst_host_recording_t *const *recordings, size_t count,
                                  const hyst_host_model_t *model, const char *path) {
    provenance_note_t *note = provenance_note();
    for (size_t i = 0; i < count; i++) {
        provenance_note_add(note, recordings[i]->note);
    }
    provenance_note_add(note, model != NULL ? model->note : NULL);
    if (path != NULL) {
        provenance_note_add_file(note, path);
    }
    return note;
}

hyst_host_recording_t *interface_recording(const recording_t *recording, provenance_note_t *note) {
    hyst_host_recording_t *handle = allocate(1, sizeof *handle);
    *handle = (hyst_host_recording_t){*recording, note};
    return handle;
}

hyst_host_model_t *interface_model(const model_t *model, provenance_note_t *note) {
    hyst_host_model_t *handle = allocate(1, sizeof *handle);
    *handle = (hyst_host_model_t){*model, note};
    return handle;
}
