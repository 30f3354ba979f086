/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Diagnoses of hyst_interface.h. */
#include "base/monotonic_clock.h"
#include "interface/handles.h"
#include "interface/interface_work.h"
#include "interface/sure.h"
#include <stdlib.h>
#include <string.h>

/* Recordings of each kind that --sure simulates: more take years. */
enum { MOST_EACH = 1000000 };

struct hyst_host_diagnosis {
    size_t count;
    recording_t *recordings; /* copies: faults mask samples, and the caller may free his */
    diagnosis_run_t run;
    double took_s;
    char *written_to; /* of run.answer */
    provenance_note_t *note;
};

static void free_recordings(hyst_host_diagnosis_t *diagnosis) {
    interface_recordings_free(diagnosis->recordings, diagnosis->count);
    provenance_note_free(diagnosis->note);
    free(diagnosis->written_to);
    free(diagnosis);
}

hyst_host_diagnosis_t *hyst_host_diagnose(const hyst_host_recording_t *const *recordings, size_t count,
                                          const hyst_host_model_t *model) {
    return hyst_host_diagnose_at_most(recordings, count, model, 0);
}

hyst_host_diagnosis_t *hyst_host_diagnose_at_most(const hyst_host_recording_t *const *recordings, size_t count,
                                                  const hyst_host_model_t *model, size_t samples) {
    if (count == 0) {
        fail(interface_failure(), "no recordings to diagnose");
        return NULL;
    }
    hyst_host_diagnosis_t *diagnosis = allocate(1, sizeof *diagnosis);
    diagnosis->count = count;
    diagnosis->note = interface_note(recordings, count, model, NULL);
    diagnosis->recordings = interface_recordings(recordings, count);
    if (diagnosis->recordings == NULL) {
        provenance_note_free(diagnosis->note);
        free(diagnosis);
        return NULL;
    }
    interface_work_begin();
    const double begun_s = monotonic_s();
    const bool good = diagnosis_run(model != NULL ? &model->model : NULL, diagnosis->recordings, count, samples,
                                    &diagnosis->run, interface_failure());
    interface_work_end();
    diagnosis->took_s = monotonic_s() - begun_s;
    if (!good) {
        free_recordings(diagnosis);
        return NULL;
    }
    return diagnosis;
}

size_t hyst_host_diagnosis_sure(hyst_host_diagnosis_t *diagnosis, const hyst_host_model_t *model, size_t each,
                                unsigned long seed) {
    sure_work_t work;
    if (each > MOST_EACH) {
        fail(interface_failure(), "%zu recordings of each kind: at most %d", each, MOST_EACH);
        return 0;
    }
    interface_work_begin();
    sure_prepare(&diagnosis->run, each, seed, diagnosis->took_s, &work);
    const bool good = sure_ask(&work, model != NULL ? &model->model : NULL, diagnosis->recordings, diagnosis->count,
                               &diagnosis->run, interface_failure());
    interface_work_end();
    return good ? diagnosis->run.sure.each : 0;
}

char *hyst_host_diagnosis_json(const hyst_host_diagnosis_t *diagnosis) {
    return interface_text(diagnosis_run_to_json(&diagnosis->run, diagnosis->recordings, diagnosis->count));
}

char *hyst_host_diagnosis_text(const hyst_host_diagnosis_t *diagnosis) {
    char *text = NULL;
    size_t length;
    FILE *file = open_memstream(&text, &length);
    if (file == NULL) {
        fail(interface_failure(), "no memory for the text of a diagnosis");
        return NULL;
    }
    diagnosis_run_print(file, &diagnosis->run, diagnosis->recordings, diagnosis->count);
    return fclose(file) == 0 ? text : NULL;
}

void hyst_host_diagnosis_set_title(hyst_host_diagnosis_t *diagnosis, const char *title) {
    provenance_note_set_title(diagnosis->note, title);
}

int hyst_host_diagnosis_report(const hyst_host_diagnosis_t *diagnosis, const char *path) {
    provenance_note_t *before = provenance_enter(diagnosis->note);
    const bool good =
        diagnosis_run_report(&diagnosis->run, diagnosis->recordings, diagnosis->count, path, interface_failure());
    (void)provenance_enter(before);
    return good;
}

int hyst_host_diagnosis_save(hyst_host_diagnosis_t *diagnosis, const char *path) {
    const bool good = model_write(&diagnosis->run.answer.model, path, interface_failure());
    if (good) {
        free(diagnosis->written_to);
        diagnosis->run.answer.written_to = diagnosis->written_to = copy_text(path);
    }
    return good;
}

hyst_host_model_t *hyst_host_diagnosis_model(const hyst_host_diagnosis_t *diagnosis) {
    model_t model;
    provenance_note_t *note = provenance_note();
    model_copy(&model, &diagnosis->run.answer.model);
    provenance_note_add(note, diagnosis->note);
    return interface_model(&model, note);
}

const double *hyst_host_diagnosis_column(const hyst_host_diagnosis_t *diagnosis, size_t index, const char *column) {
    const account_t *account = &diagnosis->run.account;
    if (index >= diagnosis->count) {
        return NULL;
    }
    return strcmp(column, "before") == 0  ? account->before[index]
           : strcmp(column, "after") == 0 ? account->after[index]
                                          : NULL;
}

size_t hyst_host_diagnosis_from(const hyst_host_diagnosis_t *diagnosis, size_t index) {
    return index < diagnosis->count ? diagnosis->run.account.from[index] : 0;
}

void hyst_host_diagnosis_free(hyst_host_diagnosis_t *diagnosis) {
    if (diagnosis != NULL) {
        diagnosis_run_free(&diagnosis->run);
        free_recordings(diagnosis);
    }
}
