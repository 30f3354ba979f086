/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/search/heard.h"
#include "belief/suspect_fit.h"
#include "diagnosis/judgement/no_physics.h"
#include "thresholds/thresholds.h"

/* A curve is shape: the operator has it. NULL: none says enough. */
static const suspect_t *loudest(const samples_t *samples, fitted_chain_t *beside, const probe_setting_t *setting) {
    const suspects_t *scanned = fitted_chain_suspects(beside, setting);
    if (scanned->count == 0 || scanned->suspect[0].gain < threshold.evidence_margin) {
        return NULL;
    }
    const suspects_t *searched = fitted_suspects(beside, setting);
    for (size_t i = 0; i < searched->count; i++) {
        const suspect_t *suspect = &searched->suspect[i];
        if (suspect->gain >= threshold.least_searched_gain && !suspect->block->probe->shape &&
            !no_physics(samples, &suspect->chain.block[suspect->at])) {
            return suspect;
        }
    }
    return NULL;
}

/* With the standard errors of its numbers, beside the operator that was fitted with it. false: they determine none. */
static bool take(heard_t *heard, const suspect_t *suspect, fitted_chain_t *with, const probe_setting_t *setting) {
    suspect_t *kept = &heard->suspect[heard->count];
    *kept = *suspect;
    model_copy(&kept->chain, &suspect->chain);
    const scan_t scan = fitted_chain_scan(with, setting);
    scan_errors(&scan, &kept->chain, kept->at);
    if (!block_determined(&kept->chain.block[kept->at])) {
        model_free(&kept->chain);
        return false;
    }
    return true;
}

void heard_listen(const state_t *state, heard_t *heard) {
    const question_t *question = state->answer.question;
    fitted_chain_t chain[HEARD_MOST], *beside = state->beside;
    *heard = (heard_t){.shape = question->shape};
    const suspect_t *suspect = loudest(&question->samples, beside, &state->setting);
    while (suspect != NULL && heard->count < HEARD_MOST) {
        fitted_chain_t *with = &chain[heard->count];
        if (!fitted_chain_open(with, &question->samples, &suspect->chain, &beside->hysteresis)) {
            break;
        }
        if (!take(heard, suspect, with, &state->setting)) {
            fitted_chain_close(with);
            break;
        }
        const double before = heard->shape.operator_percent;
        shape_t shape = heard->shape;
        shape_of(with, question->step_um, &shape);
        /* As of any finding: samples that no fit saw have to miss it. What a look has shown they need not: the operator
         * may imitate a rail there, too. */
        if (!(shape.operator_percent < (suspect->shown ? threshold.clearly_more : 1.0) * before)) {
            model_free(&heard->suspect[heard->count].chain);
            fitted_chain_close(with);
            break;
        }
        heard->shape = shape;
        heard->before_percent[heard->count] = before;
        heard->after_percent[heard->count++] = shape.operator_percent;
        beside = with;
        suspect = heard->count < HEARD_MOST ? loudest(&question->samples, beside, &state->setting) : NULL;
    }
    for (size_t i = 0; i < heard->count; i++) {
        fitted_chain_close(&chain[i]);
    }
}

void heard_free(heard_t *heard) {
    for (size_t i = 0; i < heard->count; i++) {
        model_free(&heard->suspect[i].chain);
    }
    *heard = (heard_t){0};
}
