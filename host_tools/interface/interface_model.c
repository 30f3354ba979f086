/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Models of hyst_interface.h: fit, simulate, compile. */
#include "chain/chain.h"
#include "compile/compile.h"
#include "compile/compile_json.h"
#include "identify/fit.h"
#include "interface/exchanged.h"
#include "interface/handles.h"
#include "interface/interface_work.h"
#include <stdlib.h>
#include <string.h>

hyst_host_model_t *hyst_host_model_read(const char *path) {
    model_t model;
    return model_read(&model, path, interface_failure()) ? interface_model(&model, interface_note(NULL, 0, NULL, path))
                                                         : NULL;
}

hyst_host_model_t *hyst_host_model_from_json(const char *text) {
    json_error_t error;
    model_t model;
    json_t *json = json_loads(text, JSON_REJECT_DUPLICATES, &error);
    if (json == NULL) {
        fail(interface_failure(), "model:%d: %s", error.line, error.text);
        return NULL;
    }
    const bool good = model_from_json(&model, json, "model", interface_failure());
    json_decref(json);
    return good ? interface_model(&model, provenance_note()) : NULL;
}

char *hyst_host_model_to_json(const hyst_host_model_t *model) {
    return interface_text(model_to_json(&model->model));
}

int hyst_host_model_write(const hyst_host_model_t *model, const char *path) {
    return model_write(&model->model, path, interface_failure());
}

void hyst_host_model_free(hyst_host_model_t *model) {
    if (model != NULL) {
        model_free(&model->model);
        provenance_note_free(model->note);
        free(model);
    }
}

char *hyst_host_families(void) {
    json_t *list = json_array();
    for (size_t i = 0; i < families_count; i++) {
        json_array_append_new(list, json_pack("{s:s, s:s, s:b}", "name", families[i]->name, "text", families[i]->text,
                                              "one_sine", families[i]->one_sine));
    }
    return interface_text(list);
}

int hyst_host_columns_check(const hyst_host_recording_t *const *recordings, size_t count, const char *hint) {
    recording_t *copies = interface_recordings(recordings, count);
    if (copies == NULL) {
        return 0;
    }
    interface_work_begin();
    const bool good = exchanged_refuse(copies, count, hint, interface_failure());
    interface_work_end();
    interface_recordings_free(copies, count);
    return good;
}

static hyst_host_model_t *fit_family(const family_t *family, const hyst_host_recording_t *const *recordings,
                                     size_t count, const fit_options_t *options) {
    model_t model;
    fit_report_t report;
    recording_t *copies = interface_recordings(recordings, count);
    if (copies == NULL) {
        return NULL;
    }
    interface_work_begin();
    const bool good = fit_recordings(family, copies, count, options, &model, &report, interface_failure());
    interface_work_end();
    interface_recordings_free(copies, count);
    if (!good) {
        return NULL;
    }
    fit_report_free(&report);
    return interface_model(&model, interface_note(recordings, count, NULL, NULL));
}

hyst_host_model_t *hyst_host_fit(const hyst_host_recording_t *const *recordings, size_t count, const char *options) {
    const char *name = families[0]->name;
    json_int_t operators = 0;
    int creep = 0, use_all = 0;
    json_t *json = interface_options(options, "{s?s, s?I, s?b, s?b}", "family", &name, "operators", &operators, "creep",
                                     &creep, "use_all", &use_all);
    hyst_host_model_t *model = NULL;
    const family_t *family = json != NULL ? family_find(name) : NULL;
    if (count == 0) {
        fail(interface_failure(), "no recordings to fit");
    } else if (json != NULL && family == NULL) {
        char all[400];
        family_list_names(all, sizeof all);
        fail(interface_failure(), "unknown family '%s': there are %s", name, all);
    } else if (operators < 0 || operators > FAMILY_MAX_OPERATORS) {
        fail(interface_failure(), "operators: '%lld' is not auto or a number from 1 to %d", (long long)operators,
             FAMILY_MAX_OPERATORS);
    } else if (json != NULL) {
        const fit_options_t settings = {.creep = creep != 0, .operators = (size_t)operators, .use_all = use_all != 0};
        model = fit_family(family, recordings, count, &settings);
    }
    json_decref(json);
    return model;
}

int hyst_host_simulate(const hyst_host_model_t *model, double sample_rate_hz, size_t samples, const double *drive_v,
                       const char *options, double *position_um) {
    double preload_n = 0.0;
    json_int_t seed = 1;
    json_t *json = interface_options(options, "{s?F, s?I}", "preload_n", &preload_n, "seed", &seed);
    const bool seeded =
        json != NULL && (seed >= 0 || fail(interface_failure(), "seed: %lld is below 0", (long long)seed));
    hyst_host_recording_t *recording = seeded ? hyst_host_recording_make("drive", sample_rate_hz, samples) : NULL;
    bool good = recording != NULL && hyst_host_recording_set_column(recording, "drive", drive_v) != 0;
    if (good && preload_n != 0.0) {
        char text[40];
        snprintf(text, sizeof text, "%.17g", preload_n);
        recording_set_key(&recording->recording, "preload_n", text);
    }
    good = good && chain_simulate_finite(&model->model, &recording->recording, (uint64_t)seed, position_um,
                                         interface_failure());
    hyst_host_recording_free(recording);
    json_decref(json);
    return good;
}

unsigned char *hyst_host_compile(const hyst_host_model_t *model, const char *options, size_t *length, char **report) {
    compile_options_t settings = {0};
    compile_report_t compiled;
    hyst_parameters_t parameters;
    const char *follow = "reading";
    int filters = 1;
    unsigned char bytes[IMAGE_MOST_BYTES], *image = NULL;
    json_t *json = interface_options(
        options, "{s?F, s?[FF!], s?[FF!], s?F, s?F, s?F, s?s, s?b}", "sample_rate_hz", &settings.sample_rate_hz,
        "drive_range_v", &settings.drive_range_v[0], &settings.drive_range_v[1], "position_range_um",
        &settings.position_range_um[0], &settings.position_range_um[1], "delay_s", &settings.delay_s, "frequency_hz",
        &settings.frequency_hz, "preload_n", &settings.preload_n, "follow", &follow, "filters", &filters);
    if (json == NULL) {
        return NULL;
    }
    settings.no_filters = filters == 0;
    settings.follow_position = strcmp(follow, "position") == 0;
    const bool known = settings.follow_position || strcmp(follow, "reading") == 0 ||
                       fail(interface_failure(), "follow '%s': not reading or position", follow);
    json_decref(json);
    if (known && compile_model(&model->model, &settings, &parameters, &compiled, interface_failure()) &&
        image_to_bytes(&parameters, bytes, length, "image", interface_failure())) {
        image = allocate(*length, 1);
        memcpy(image, bytes, *length);
        if (report != NULL) {
            *report = interface_text(compile_to_json(&parameters, &compiled));
        }
    }
    return image;
}
