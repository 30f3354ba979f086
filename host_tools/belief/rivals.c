/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/rivals.h"
#include "base/parallel.h"
#include "belief/suspect_fit.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/candidate.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

/* So many of a scan: those that promise most. */
enum { REFINED = 6 };
/* Fits of each that is in question, beginning with numbers that were searched. Creep needs more than two where its
 * numbers were searched beside weights that had taken a part of it. */
enum { TURNS = 4 };

/* By how much less evidence another block may have. */
static double margin_of(const block_t *block, const block_t *other, double gain) {
    const bool lags = block->lag != LAG_NONE && other->lag != LAG_NONE;
    return fmax(threshold.evidence_margin,
                (lags ? threshold.evidence_margin_part_lag : threshold.evidence_margin_part) * gain);
}

static double gain_of(const suspects_t *suspects, const block_t *block) {
    for (size_t i = 0; i < suspects->count; i++) {
        if (suspects->suspect[i].block == block) {
            return suspects->suspect[i].gain;
        }
    }
    return 0.0;
}

static void choose(const suspects_t *suspects, const block_t *block, rivals_t *rivals) {
    const suspect_t *suspect = suspects->suspect;
    *rivals = (rivals_t){0};
    rivals->gain = gain_of(suspects, block);
    for (size_t i = 0; i < suspects->count; i++) {
        const block_t *other = suspect[i].block;
        if (other == block) {
            continue;
        }
        rivals->best_gain = fmax(rivals->best_gain, suspect[i].gain);
        if (rivals->gain >= threshold.evidence_margin && rivals->count < RIVALS_MOST &&
            suspect[i].gain > rivals->gain - margin_of(block, other, rivals->gain)) {
            rivals->rival[rivals->count++] = other;
        }
    }
}

typedef struct {
    const scan_t *scan;
    suspects_t *suspects;
} refined_t;

static void refine_one(void *context, size_t index) {
    const refined_t *job = context;
    scan_refine(job->scan, SCAN_STEPS, &job->suspects->suspect[index]);
}

/* strong: what a block's best probe was worth, if that is more than its refined numbers are. These go with weights that
 * did without the block. */
static void refine_all(const scan_t *scan, bool strong, suspects_t *suspects) {
    double *probed = allocate(suspects->count + 1, sizeof *probed);
    for (size_t i = 0; i < suspects->count; i++) {
        probed[i] = suspects->suspect[i].gain;
    }
    parallel(suspects->count, refine_one, &(refined_t){.scan = scan, .suspects = suspects});
    for (size_t i = 0; strong && i < suspects->count; i++) {
        suspects->suspect[i].gain = fmax(suspects->suspect[i].gain, probed[i]);
    }
    free(probed);
    suspects_sort(suspects);
}

static bool is_rival(const block_t *suspect, const rivals_t *rivals) {
    bool rival = false;
    for (size_t r = 0; r < rivals->count; r++) {
        rival = rival || rivals->rival[r] == suspect;
    }
    return rival;
}

/* Whether a suspect is the block, a rival of it that is of another group, or of its group and none yet. */
static bool is_in_question(const block_t *suspect, const block_t *block, const rivals_t *rivals) {
    return suspect == block || is_rival(suspect, rivals) != block_same_group(block, suspect);
}

/* Fitted together with the weights: drops rivals of other groups that are worth less than the block, and adds those of
 * its group that are worth as much. Refined beside weights that did without the block, these may have gone astray. The
 * block itself begins with the numbers that were found. Within a group a block may be worth less only because its form
 * is too narrow. */
static void weigh_fitted(fitted_chain_t *fitted, const probe_setting_t *setting, const suspects_t *suspects,
                         const model_block_t *found, rivals_t *rivals) {
    const block_t *block = found->block;
    double value[BLOCK_MAX_PARAMETERS];
    suspects_t fits = {.suspect = allocate(suspects->count + 1, sizeof *fits.suspect)};
    size_t kept = 0;
    for (size_t i = 0; i < suspects->count; i++) {
        suspect_t *fit = &fits.suspect[fits.count];
        if (!is_in_question(suspects->suspect[i].block, block, rivals)) {
            continue;
        }
        *fit = suspects->suspect[i];
        fits.count++;
        if (fit->block == block) {
            candidate_value(found, value);
            fit->at = candidate_insert(&fit->chain, &fitted->imitation.chain, block, value);
        } else {
            model_copy(&fit->chain, &suspects->suspect[i].chain);
        }
    }
    if (fits.count > 1) {
        suspects_fit(fitted, setting, TURNS, &fits);
    }
    const double gain = gain_of(&fits, block);
    for (size_t r = 0; r < rivals->count; r++) {
        const block_t *other = rivals->rival[r];
        if (block_same_group(block, other) || gain_of(&fits, other) > gain - margin_of(block, other, gain)) {
            rivals->rival[kept++] = other;
        }
    }
    rivals->count = kept;
    for (size_t i = 0; i < fits.count && rivals->count < RIVALS_MOST; i++) {
        const block_t *other = fits.suspect[i].block;
        if (other != block && block_same_group(block, other) && !is_rival(other, rivals) &&
            fits.suspect[i].gain > gain - margin_of(block, other, gain)) {
            rivals->rival[rivals->count++] = other;
        }
    }
    suspects_free(&fits);
}

void rivals_elsewhere(fitted_chain_t *fitted, const probe_setting_t *setting, const model_block_t *found,
                      rivals_t *rivals) {
    double value[BLOCK_MAX_PARAMETERS];
    suspects_t suspects = {.suspect = allocate(catalogue_count, sizeof *suspects.suspect)};
    *rivals = (rivals_t){0};
    candidate_value(found, value);
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (block->probe != NULL && block->parameter == found->block->parameter) {
            suspect_t *suspect = &suspects.suspect[suspects.count++];
            *suspect = (suspect_t){.block = block, .amplitude = 1.0, .refined = true};
            suspect->at = candidate_insert(&suspect->chain, &fitted->imitation.chain, block, value);
        }
    }
    if (suspects.count > 1) {
        suspects_fit(fitted, setting, TURNS, &suspects);
        choose(&suspects, found->block, rivals);
    }
    suspects_free(&suspects);
}

/* The scan is made anew: the setting knows the numbers of what was found, and begins there. */
void rivals_of(fitted_chain_t *fitted, const probe_setting_t *setting, const block_t *block,
               const model_block_t *strong, rivals_t *rivals) {
    const scan_t scan = fitted_chain_scan(fitted, setting);
    suspects_t scanned, suspects;
    scan_blocks(&scan, &scanned);
    suspects_copy(&scanned, scan_promising(&scanned, REFINED), &suspects);
    suspects_free(&scanned);
    refine_all(&scan, strong != NULL, &suspects);
    choose(&suspects, block, rivals);
    if (strong != NULL) {
        weigh_fitted(fitted, setting, &suspects, strong, rivals);
    }
    suspects_free(&suspects);
}
