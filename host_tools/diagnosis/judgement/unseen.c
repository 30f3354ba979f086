/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/judgement/unseen.h"
#include "belief/suspect_fit.h"
#include "chain/catalogue.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/evidence/probing.h"
#include "diagnosis/noise/lattice.h"
#include "diagnosis/nuisance/nuisance.h"
#include "diagnosis/where/loop_parts.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <string.h>

/* Why the nuisance subspace leaves nothing of a block, as far as the drive says it. */
static const char *why_imitated(const answer_t *answer, const block_t *block) {
    const question_t *question = answer->question;
    if (samples_reversals(&question->samples, threshold.turns_round) == 0) {
        return "the drive never turns round, and on the way in one direction other numbers imitate it";
    }
    if (nuisance_loop_hz(&question->samples) > 0.0) {
        return "the drive repeats one loop, and a hysteresis may have any shape there";
    }
    if (block->place == PLACE_SLOW && !question->noise.at_rest) {
        return "the drive never rests for long, and while it moves other numbers imitate it";
    }
    return "other numbers imitate it";
}

static void note(answer_t *answer, unseen_t unseen) {
    if (answer->unseen_count < DIAGNOSIS_MOST_UNSEEN) {
        answer->unseen[answer->unseen_count++] = unseen;
    }
}

static void note_untestable(answer_t *answer, const block_t *block, const char *why) {
    note(answer, (unseen_t){.block = block, .why = why, .smallest_um = HUGE_VAL, .parameter = block->parameters});
}

/* The parameter that the size goes with, if the block has one, and whether the block can be so large. */
static void judge_form(unseen_t *unseen) {
    const block_t *block = unseen->block;
    unseen->parameter = block->parameters;
    unseen->testable = true;
    for (size_t p = block->parameters; p-- > 0;) {
        if (block->parameter[p].proportional && unseen->form[p] != 0.0) {
            unseen->parameter = p;
            unseen->value = unseen->form[p];
            unseen->testable = unseen->testable && fabs(unseen->value) <= block->parameter[p].high;
        }
    }
    unseen->why = unseen->testable ? NULL : "it would have to be larger than such a block can be";
}

static void note_candidate(answer_t *answer, const candidate_t *c) {
    const block_t *block = c->block;
    const double least_um =
        block->probe->shape && answer->family != NULL ? threshold.least_curve * answer->question->noise.rms_um : 0.0;
    const double smallest_um = fmax(c->smallest_um, least_um), larger = smallest_um / c->smallest_um;
    unseen_t unseen = {.block = block, .smallest_um = smallest_um};
    if (!isfinite(c->smallest_um)) {
        note_untestable(answer, block, why_imitated(answer, block));
        return;
    }
    for (size_t p = 0; p < block->parameters; p++) {
        unseen.form[p] = c->smallest_value[p] * (block->parameter[p].proportional ? larger : 1.0);
    }
    judge_form(&unseen);
    note(answer, unseen);
}

void unseen_note(answer_t *answer, const candidates_t *found) {
    for (size_t i = 0; i < found->count; i++) {
        note_candidate(answer, &found->candidate[i]);
    }
}

static bool is_noted(const answer_t *answer, const block_t *block) {
    for (size_t i = 0; i < answer->unseen_count; i++) {
        if (answer->unseen[i].block == block) {
            return true;
        }
    }
    return false;
}

/* The step that would have shown: not too fine for the readings to come back to it, and large enough to matter. */
static void note_steps(state_t *state, const block_t *block) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    double range[2];
    lattice_visible_steps(question->samples.recordings, question->samples.count, range);
    const double smallest = fmax(range[0], threshold.least_steps * sqrt(12.0) * question->noise.rms_um);
    if (smallest < range[1]) {
        note(answer,
             (unseen_t){.block = block, .testable = true, .smallest_um = smallest / sqrt(12.0), .value = smallest});
    } else {
        note_untestable(answer, block, "too few samples for steps to stand out of the readings");
    }
}

/* Why the chain cannot have the block, or the recordings no instance of it; NULL: it can be probed. */
static const char *why_not_probed(const state_t *state, const block_t *block) {
    double value[BLOCK_MAX_PARAMETERS] = {0.0};
    const model_t *model = &state->answer.model;
    for (size_t b = 0; b < model->blocks; b++) {
        if (block->widens && block_is_hysteresis(model->block[b].block) && !model->block[b].block->can_widen) {
            return "the loops of this hysteresis cannot be widened: its equation has no thresholds";
        }
    }
    return block->probe->probe(&state->setting, 0, value) ? NULL : block->probe->absent;
}

static void probe_one(state_t *state, evidence_t *evidence, const model_t *chain, const block_t *block) {
    const search_problem_t problem = {
        .evidence = evidence, .noise = &state->answer.question->noise, .baseline = chain, .setting = &state->setting};
    candidate_t best;
    evidence_ask(evidence, block->probe->shape ? ASK_SHAPES : ASK_EFFECTS);
    if (probe_block(&problem, block, &best)) {
        note_candidate(&state->answer, &best);
        candidate_free(&best);
    } else {
        note_untestable(&state->answer, block, "this chain cannot be simulated with it");
    }
}

/* What only a probe says, in the chain without what is no response to a drive. */
static bool probe_rest(state_t *state, const block_t *const *rest, size_t count) {
    answer_t *answer = &state->answer;
    const question_t *question = answer->question;
    model_t chain;
    model_copy(&chain, &answer->model);
    model_without_noise(&chain);
    evidence_t *evidence =
        count > 0 ? evidence_open(&chain, &question->samples, &question->noise, state->failure) : NULL;
    for (size_t i = 0; evidence != NULL && i < count; i++) {
        probe_one(state, evidence, &chain, rest[i]);
    }
    const bool good = count == 0 || evidence != NULL;
    evidence_close(evidence);
    model_free(&chain);
    return good;
}

bool unseen_complete(state_t *state) {
    answer_t *answer = &state->answer;
    const block_t *rest[DIAGNOSIS_MOST_UNSEEN];
    size_t count = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        if (!probe_is_first(block->probe) || is_noted(answer, block) ||
            model_find(&answer->model, block->name) != NULL || finding_may_be(answer, block)) {
            continue;
        }
        const char *why = why_not_probed(state, block);
        if (block->readings == READINGS_STEPPED) {
            note_steps(state, block);
        } else if (why != NULL) {
            note_untestable(answer, block, why);
        } else if (count < DIAGNOSIS_MOST_UNSEEN) {
            rest[count++] = block;
        }
    }
    return probe_rest(state, rest, count);
}

/* What a scan says of a block; NULL: the operator imitates every form of it. */
static const suspect_t *suspect_of(const suspects_t *suspects, const block_t *block) {
    for (size_t i = 0; i < suspects->count; i++) {
        if (suspects->suspect[i].block == block) {
            return &suspects->suspect[i];
        }
    }
    return NULL;
}

static void raise_limits(answer_t *answer, const suspects_t *suspects) {
    for (size_t i = 0; i < answer->unseen_count; i++) {
        unseen_t *unseen = &answer->unseen[i];
        const suspect_t *heard = suspect_of(suspects, unseen->block);
        if (!unseen->testable || unseen->block->readings == READINGS_STEPPED) {
            continue;
        }
        if (heard == NULL || unseen->block->probe->shape) {
            *unseen = (unseen_t){.block = unseen->block,
                                 .why = heard == NULL ? "a hysteresis of another shape imitates it"
                                                      : "the other shape of the hysteresis may be just this",
                                 .smallest_um = HUGE_VAL,
                                 .parameter = unseen->block->parameters};
        } else if (heard->smallest_um > unseen->smallest_um) {
            unseen->smallest_um = heard->smallest_um;
            memcpy(unseen->form, heard->smallest_value, sizeof unseen->form);
            judge_form(unseen);
        }
    }
}

void unseen_beside_operator(state_t *state) {
    answer_t *answer = &state->answer;
    fitted_chain_t *fitted = answer->another_shape ? state_fitted(state, &answer->model) : NULL;
    if (fitted != NULL) {
        raise_limits(answer, fitted_chain_suspects(fitted, &state->setting));
    }
}
