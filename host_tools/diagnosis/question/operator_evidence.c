/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/question/operator_evidence.h"
#include "belief/fitted_chain.h"
#include "diagnosis/question/baseline.h"

bool operator_evidence(const recording_t *recordings, size_t count, double *log_evidence) {
    baseline_t bank, rough;
    samples_t samples;
    failure_t refusal;
    bool fitted = false;
    if (!baseline_bank(recordings, count, &bank, &rough, &refusal)) {
        return false;
    }
    if (samples_open(&samples, &bank.model, recordings, count, &refusal)) {
        fitted_chain_t chain;
        model_t alone;
        chain_for_operator(&bank.model, &alone);
        fitted = fitted_chain_open(&chain, &samples, &alone, NULL);
        if (fitted) {
            *log_evidence = chain.hysteresis.evidence.log_evidence;
            fitted_chain_close(&chain);
        }
        model_free(&alone);
    }
    samples_close(&samples);
    baseline_free(&bank, 1);
    baseline_free(&rough, 1);
    return fitted;
}
