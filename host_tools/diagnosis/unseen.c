/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/unseen.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/probing.h"
#include "diagnosis/findings.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/nuisance/nuisance.h"
#include "diagnosis/where/loop_parts.h"
#include "thresholds/thresholds.h"
#include <math.h>

/* Why the nuisance subspace leaves nothing of a block, as far as the drive says it. */
static const char *why_imitated(const diagnosis_t *d, const block_t *block) {
    if (samples_reversals(&d->samples, threshold.turns_round) == 0) {
        return "the drive never turns round, and on the way in one direction other numbers imitate it";
    }
    if (nuisance_loop_hz(&d->samples) > 0.0) {
        return "the drive repeats one loop, and a hysteresis may have any shape there";
    }
    if (block->place == PLACE_SLOW && !d->noise.at_rest) {
        return "the drive never rests for long, and while it moves other numbers imitate it";
    }
    return "other numbers imitate it";
}

static void note(diagnosis_t *d, unseen_t unseen) {
    if (d->unseen_count < DIAGNOSIS_MOST_UNSEEN) {
        d->unseen[d->unseen_count++] = unseen;
    }
}

static void note_untestable(diagnosis_t *d, const block_t *block, const char *why) {
    note(d, (unseen_t){.block = block, .why = why, .smallest_um = HUGE_VAL, .parameter = block->parameters});
}

static void note_candidate(diagnosis_t *d, const candidate_t *c) {
    const block_t *block = c->block;
    const double least_um = block->probe->shape && d->family != NULL ? threshold.least_curve * d->noise.rms_um : 0.0;
    const double smallest_um = fmax(c->smallest_um, least_um), larger = smallest_um / c->smallest_um;
    unseen_t unseen = {.block = block, .testable = true, .smallest_um = smallest_um, .parameter = block->parameters};
    if (!isfinite(c->smallest_um)) {
        note_untestable(d, block, why_imitated(d, block));
        return;
    }
    for (size_t p = block->parameters; p-- > 0;) {
        unseen.form[p] = c->smallest_value[p] * (block->parameter[p].proportional ? larger : 1.0);
        if (block->parameter[p].proportional && c->smallest_value[p] != 0.0) {
            unseen.parameter = p;
            unseen.value = unseen.form[p];
            unseen.testable = unseen.testable && fabs(unseen.value) <= block->parameter[p].high;
        }
    }
    unseen.why = unseen.testable ? NULL : "it would have to be larger than such a block can be";
    note(d, unseen);
}

void unseen_note(diagnosis_t *d, const candidates_t *found) {
    for (size_t i = 0; i < found->count; i++) {
        note_candidate(d, &found->candidate[i]);
    }
}

static bool is_noted(const diagnosis_t *d, const block_t *block) {
    for (size_t i = 0; i < d->unseen_count; i++) {
        if (d->unseen[i].block == block) {
            return true;
        }
    }
    return false;
}

/* The step that would have shown: not too fine for the readings to come back to it, and large enough to matter. */
static void note_steps(attempt_t *job, const block_t *block) {
    diagnosis_t *d = job->diagnosis;
    double range[2];
    lattice_visible_steps(d->samples.recordings, d->samples.count, range);
    const double smallest = fmax(range[0], threshold.least_steps * sqrt(12.0) * d->noise.rms_um);
    if (smallest < range[1]) {
        note(d, (unseen_t){.block = block, .testable = true, .smallest_um = smallest / sqrt(12.0), .value = smallest});
    } else {
        note_untestable(d, block, "too few samples for steps to stand out of the readings");
    }
}

/* Why the chain cannot have the block, or the recordings no instance of it; NULL: it can be probed. */
static const char *why_not_probed(const attempt_t *job, const block_t *block) {
    double value[BLOCK_MAX_PARAMETERS] = {0.0};
    const model_t *model = &job->diagnosis->model;
    for (size_t b = 0; b < model->blocks; b++) {
        if (block->widens && block_is_hysteresis(model->block[b].block) && !model->block[b].block->can_widen) {
            return "the loops of this hysteresis cannot be widened: its equation has no thresholds";
        }
    }
    return block->probe->probe(&job->setting, 0, value) ? NULL : block->probe->absent;
}

static void probe_one(attempt_t *job, evidence_t *evidence, const model_t *chain, const block_t *block) {
    const search_problem_t problem = {
        .evidence = evidence, .noise = &job->diagnosis->noise, .baseline = chain, .setting = &job->setting};
    candidate_t best;
    evidence_ask(evidence, block->probe->shape ? ASK_SHAPES : ASK_EFFECTS);
    if (probe_block(&problem, block, &best)) {
        note_candidate(job->diagnosis, &best);
        candidate_free(&best);
    } else {
        note_untestable(job->diagnosis, block, "this chain cannot be simulated with it");
    }
}

/* What only a probe says, in the chain without what is no response to a drive. */
static bool probe_rest(attempt_t *job, const block_t *const *rest, size_t count) {
    diagnosis_t *d = job->diagnosis;
    model_t chain;
    model_copy(&chain, &d->model);
    attempt_without_noise(&chain);
    evidence_t *evidence = count > 0 ? evidence_open(&chain, &d->samples, &d->noise, job->failure) : NULL;
    for (size_t i = 0; evidence != NULL && i < count; i++) {
        probe_one(job, evidence, &chain, rest[i]);
    }
    const bool good = count == 0 || evidence != NULL;
    evidence_close(evidence);
    model_free(&chain);
    return good;
}

bool unseen_complete(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    const block_t *rest[DIAGNOSIS_MOST_UNSEEN];
    size_t count = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (!probe_is_first(block->probe) || is_noted(d, block) || model_find(&d->model, block->name) != NULL ||
            finding_may_be(d, block)) {
            continue;
        }
        const char *why = why_not_probed(job, block);
        if (block->readings == READINGS_STEPPED) {
            note_steps(job, block);
        } else if (why != NULL) {
            note_untestable(d, block, why);
        } else if (count < DIAGNOSIS_MOST_UNSEEN) {
            rest[count++] = block;
        }
    }
    return probe_rest(job, rest, count);
}
