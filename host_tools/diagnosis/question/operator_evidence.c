/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/question/operator_evidence.h"
#include "belief/shape.h"
#include "diagnosis/question/baseline.h"

bool operator_evidence(const recording_t *recordings, size_t count, double *log_evidence) {
    baseline_t bank, rough;
    samples_t samples;
    failure_t refusal;
    shape_t shape = {0};
    if (!baseline_bank(recordings, count, &bank, &rough, &refusal)) {
        return false;
    }
    if (samples_open(&samples, &bank.model, recordings, count, &refusal)) {
        shape_ask(&samples, &bank.model, 0.0, &shape);
        *log_evidence = shape.log_evidence;
    }
    samples_close(&samples);
    baseline_free(&bank, 1);
    baseline_free(&rough, 1);
    return shape.fitted;
}
