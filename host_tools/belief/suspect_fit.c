/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/suspect_fit.h"
#include "base/parallel.h"
#include "diagnosis/evidence/candidate.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* Each turn is a fit of some 300 weights: a second or so. A strong mode may need twice as many as the usual ones, and
 * is then worth much more from turn to turn. */
enum { MOST_SUSPECTS = 3, USUAL_TURNS = 4, MOST_TURNS = 16 };
/* Natural units: a turn that is worth less is the last one, and one that promises less is none. In parts of what it is
 * worth by now: one that is worth more is not the last one. Of 203 turns 31 promised less than worth_a_turn, and none
 * of them was worth more than 0.21. */
static const double settled = 0.5, worth_a_turn = 0.1, growing = 0.1;

/* The numbers that it begins with: as the scan's weights have them, or, where these lead nowhere, the probe's. */
static void begin(fitted_chain_t *fitted, const probe_setting_t *setting, suspect_t *suspect) {
    const scan_t beside = fitted_chain_scan(fitted, setting);
    suspect_t searched = *suspect;
    model_copy(&searched.chain, &suspect->chain);
    scan_refine(&beside, SCAN_STEPS, &searched);
    if (searched.gain >= threshold.evidence_margin) {
        model_free(&suspect->chain);
        suspect->chain = searched.chain;
    } else {
        model_free(&searched.chain);
        candidate_take_amplitude(&suspect->chain.block[suspect->at], suspect->amplitude);
    }
    suspect->amplitude = 1.0;
}

/* Other numbers, by the weights of the fit with these: one step. A second one would go by what the operator can imitate
 * at the numbers that it has left. */
static void move_on(fitted_chain_t *with, const probe_setting_t *setting, suspect_t *suspect) {
    const scan_t scan = fitted_chain_scan(with, setting);
    suspect->amplitude = 1.0;
    scan_refine(&scan, 1, suspect);
}

static void fit_one(fitted_chain_t *fitted, const probe_setting_t *setting, int turns, suspect_t *suspect) {
    const double without = fitted->hysteresis.evidence.log_evidence, promised = suspect->gain;
    double gain = -HUGE_VAL;
    if (!suspect->refined) {
        begin(fitted, setting, suspect);
    }
    suspect_t now = *suspect;
    model_copy(&now.chain, &suspect->chain);
    bool goes_on = true;
    for (int turn = 0; goes_on && turn < turns; turn++) {
        fitted_chain_t with;
        goes_on = fitted_chain_open(&with, fitted->samples, &now.chain, &fitted->hysteresis);
        if (!goes_on) {
            break;
        }
        const double before = gain, here = with.hysteresis.evidence.log_evidence - without;
        if (here > gain) {
            gain = here;
            model_free(&suspect->chain);
            model_copy(&suspect->chain, &now.chain);
        }
        /* The first fit says little: its numbers go with weights that did without the block. Numbers that a look has
         * shown may be worth nothing, and those beside them much. */
        const double least = suspect->shown ? -HUGE_VAL : turn == 1 ? -promised : 0.0;
        goes_on = turn == 0 || (here > before + settled && here > least &&
                                (turn + 1 < USUAL_TURNS || here - before > growing * here));
        if (goes_on) {
            move_on(&with, setting, &now);
            goes_on = now.gain >= worth_a_turn;
        }
        fitted_chain_close(&with);
    }
    model_free(&now.chain);
    suspect->refined = true;
    suspect->amplitude = 1.0;
    suspect->gain = gain;
    suspect->sigma = gain > 0.0 ? 1.0 / sqrt(2.0 * gain) : HUGE_VAL;
}

typedef struct {
    fitted_chain_t *fitted;
    const probe_setting_t *setting;
    int turns;
    suspects_t *suspects;
} suspects_fit_t;

static void fit_this(void *context, size_t index) {
    const suspects_fit_t *job = context;
    fit_one(job->fitted, job->setting, job->turns, &job->suspects->suspect[index]);
}

void suspects_fit(fitted_chain_t *fitted, const probe_setting_t *setting, int turns, suspects_t *suspects) {
    (void)fitted_chain_rows(fitted); /* made once, before they share it */
    parallel(suspects->count, fit_this, &(suspects_fit_t){fitted, setting, turns, suspects});
    suspects_sort(suspects);
}

/* From the numbers that a look has shown. A scan does hear what only grows with a number of the block, and what rings,
 * which no operator imitates. */
static void fit_shown(fitted_chain_t *fitted, const probe_setting_t *setting, suspect_t *scanned) {
    double value[BLOCK_MAX_PARAMETERS] = {0.0};
    if (candidate_grows(scanned->block) || scanned->block->probe->rings != NULL ||
        !candidate_from_look(scanned->block, setting, 0, value)) {
        return;
    }
    suspect_t shown = *scanned;
    shown.at = candidate_insert(&shown.chain, &fitted->imitation.chain, scanned->block, value);
    shown.refined = shown.shown = true;
    fit_one(fitted, setting, MOST_TURNS, &shown);
    if (shown.gain > scanned->gain) {
        model_free(&scanned->chain);
        *scanned = shown;
    } else {
        model_free(&shown.chain);
    }
}

const suspects_t *fitted_chain_suspects(fitted_chain_t *fitted, const probe_setting_t *setting) {
    if (fitted->scanned.suspect == NULL) {
        const scan_t scan = fitted_chain_scan(fitted, setting);
        scan_blocks(&scan, &fitted->scanned);
        for (size_t i = 0; i < fitted->scanned.count; i++) {
            fit_shown(fitted, setting, &fitted->scanned.suspect[i]);
        }
        suspects_sort(&fitted->scanned);
    }
    return &fitted->scanned;
}

const suspects_t *fitted_suspects(fitted_chain_t *fitted, const probe_setting_t *setting) {
    if (fitted->searched.suspect == NULL) {
        const suspects_t *scanned = fitted_chain_suspects(fitted, setting);
        suspects_copy(scanned, scan_promising(scanned, MOST_SUSPECTS), &fitted->searched);
        suspects_fit(fitted, setting, MOST_TURNS, &fitted->searched);
    }
    return &fitted->searched;
}
