/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The look and the frequency response of hyst_interface.h. */
#include "interface/handles.h"
#include "look/look_json.h"
#include "look/look_text.h"
#include "report/bode.h"
#include "report/small_signal.h"
#include <stdio.h>

/* As the command prints it. NULL: no memory. */
static char *look_text(const look_t *looks, size_t count, const fault_list_t *faults) {
    char *text = NULL;
    size_t length;
    FILE *file = open_memstream(&text, &length);
    if (file == NULL) {
        fail(interface_failure(), "no memory for the text of a look");
        return NULL;
    }
    looks_print(file, looks, count, faults);
    return fclose(file) == 0 ? text : NULL;
}

char *hyst_host_look(const hyst_host_recording_t *const *recordings, size_t count, char **text) {
    if (count == 0) {
        fail(interface_failure(), "no recordings to look at");
        return NULL;
    }
    recording_t *copies = interface_recordings(recordings, count);
    look_t *looks = copies != NULL ? looks_at(copies, count, interface_failure()) : NULL;
    char *answer = NULL;
    if (looks != NULL) {
        fault_list_t faults;
        faults_find(looks, count, &faults);
        answer = interface_text(looks_to_json(looks, count, &faults));
        if (text != NULL) {
            *text = look_text(looks, count, &faults);
        }
        faults_free(&faults);
        looks_free(looks, count);
    }
    if (copies != NULL) {
        interface_recordings_free(copies, count);
    }
    return answer;
}

static char *response(const recording_t *recording, const model_t *model) {
    bode_t bode;
    char *answer = NULL;
    if (bode_ask(recording, model, &bode, interface_failure())) {
        answer = interface_text(bode_to_json(&bode));
        bode_free(&bode);
    }
    return answer;
}

static char *response_of_model(const model_t *model, const small_signal_t *small) {
    recording_t recording;
    char *answer = NULL;
    if (small_signal(model, "model", small, &recording, interface_failure())) {
        answer = response(&recording, NULL);
        recording_free(&recording);
    }
    return answer;
}

char *hyst_host_bode(const hyst_host_recording_t *recording, const hyst_host_model_t *model, const char *options) {
    small_signal_t small = small_signal_unset();
    json_t *json = interface_options(options, "{s?F, s?F, s?F}", "bias_v", &small.bias_v, "amplitude_v",
                                     &small.amplitude_v, "sample_rate_hz", &small.sample_rate_hz);
    char *answer = NULL;
    if (json == NULL) {
        return NULL;
    }
    json_decref(json);
    if (recording == NULL && model == NULL) {
        fail(interface_failure(), "a frequency response needs a recording, or a model, or both");
    } else if (recording == NULL) {
        answer = response_of_model(&model->model, &small);
    } else if (small_signal_set(&small)) {
        fail(interface_failure(), "bias_v, amplitude_v and sample_rate_hz are for a model without a recording");
    } else {
        recording_t *copy = interface_recordings(&recording, 1);
        answer = copy != NULL ? response(copy, model != NULL ? &model->model : NULL) : NULL;
        if (copy != NULL) {
            interface_recordings_free(copy, 1);
        }
    }
    return answer;
}
