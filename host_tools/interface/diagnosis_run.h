/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A whole diagnosis: the look at the recordings, what faults spoil left out, the diagnosis, and the account of it. */
#ifndef DIAGNOSIS_RUN_H
#define DIAGNOSIS_RUN_H

#include "diagnosis/account/account.h"
#include "look/fault.h"
#include "report/sure_report.h"

enum { DIAGNOSIS_LEAST_SAMPLES = 1000 };

typedef struct {
    look_t *looks; /**< what the recordings show without a model */
    fault_list_t faults;
    probe_passes_t *passes;     /**< of each recording */
    double added_noise_percent; /**< noiseless.h */
    size_t looked_at;           /**< recordings; 0: too short to look at, and the diagnosis says so */
    size_t masked;              /**< samples that faults spoil, left out */
    answer_t answer;
    account_t account;
    bool sure_asked;
    sure_t sure; /**< where that was wanted (sure.h) */
} diagnosis_run_t;

/**
 * given: the chain to begin with, or NULL. most_samples: of all recordings together, that are used (excerpt.h); 0:
 * threshold.most_samples. Fewer than DIAGNOSIS_LEAST_SAMPLES for each recording are refused. Masks what faults spoil in
 * the recordings, and sets readings right where a fault can be undone; the recordings must outlive the run. On success
 * *run is to be freed.
 */
bool diagnosis_run(const model_t *given, recording_t *recordings, size_t count, size_t most_samples,
                   diagnosis_run_t *run, failure_t *failure);

/** The whole reply as JSON, format hyst-diagnosis-1: a new reference. */
json_t *diagnosis_run_to_json(const diagnosis_run_t *run, const recording_t *recordings, size_t count);

/** The whole reply in plain words. */
void diagnosis_run_print(FILE *file, const diagnosis_run_t *run, const recording_t *recordings, size_t count);

/** As a page with pictures. */
bool diagnosis_run_report(const diagnosis_run_t *run, const recording_t *recordings, size_t count, const char *path,
                          failure_t *failure);

void diagnosis_run_free(diagnosis_run_t *run);

#endif
