/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/sure.h"
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "diagnosis/account/instead.h"
#include "diagnosis/answer/answer.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sizes of an effect that was not found, in its detection limits: one that is to be silent, and one that is to show. */
static const double sizes[] = {1.0 / 3.0, 3.0};
enum { SIZES = sizeof sizes / sizeof sizes[0], MOST_LIMITS = (SURE_MOST_WORLDS - 1) / SIZES };

/* -------------------------------------------------------------------------------------------------- the worlds --- */

/* Takes the model. Returns it, to add questions to. */
static sure_world_t *add_world(sure_work_t *work, const model_t *model) {
    sure_world_t *world = &work->world[work->worlds++];
    *world = (sure_world_t){.model = *model, .from = work->sure.count, .to = work->sure.count};
    model_without_noise(&world->model);
    return world;
}

static void add_question(sure_work_t *work, sure_world_t *world, sure_question_t question) {
    if (work->sure.count < SURE_MOST_QUESTIONS) {
        work->sure.question[work->sure.count++] = question;
        world->to = work->sure.count;
    }
}

/* The block that came next when the finding was taken; NULL: none. */
static const block_t *runner_up(const answer_t *answer, const finding_t *finding) {
    const considered_t *taken = NULL, *next = NULL;
    for (size_t i = 0; i < answer->considered; i++) {
        const considered_t *c = &answer->consideration[i];
        taken = c->block == finding->block && c->outcome == TAKEN ? c : taken;
    }
    for (size_t i = 0; taken != NULL && i < answer->considered; i++) {
        const considered_t *c = &answer->consideration[i];
        if (c->round == taken->round && c->outcome == LESS_LIKELY &&
            (next == NULL || c->likelihood > next->likelihood)) {
            next = c;
        }
    }
    return next != NULL ? next->block : NULL;
}

/* Another block in the finding's place, fitted there. */
static void add_rival(sure_work_t *work, const answer_t *answer, const finding_t *finding, const block_t *rival) {
    model_t model;
    if (work->worlds < SURE_MOST_WORLDS && model_find(&answer->model, rival->name) == NULL &&
        instead_of_finding(answer, finding, rival, &model)) {
        add_question(work, add_world(work, &model), (sure_question_t){.hidden = rival, .in_place_of = finding->block});
    }
}

static void worlds_of_findings(sure_work_t *work, const answer_t *answer) {
    model_t chain;
    instead_of_terms(answer, &chain);
    sure_world_t *world = add_world(work, &chain);
    for (size_t f = 0; f < findings_named(answer); f++) {
        const finding_t *finding = &answer->finding[f];
        if (!finding->in_readings) {
            add_question(work, world, (sure_question_t){.hidden = finding->block, .in_place_of = finding->block});
        }
    }
    for (size_t f = 0; f < findings_named(answer); f++) {
        const finding_t *finding = &answer->finding[f];
        for (size_t r = 0; r < finding->rivals; r++) {
            add_rival(work, answer, finding, finding->rival[r]);
        }
        const block_t *next = finding->rivals == 0 && !finding->in_readings ? runner_up(answer, finding) : NULL;
        if (next != NULL) {
            add_rival(work, answer, finding, next);
        }
    }
}

static bool has_asked_group(const sure_work_t *work, const block_t *block) {
    for (size_t q = 0; q < work->sure.count; q++) {
        const block_t *hidden = work->sure.question[q].hidden;
        if (hidden != NULL && block_same_group(hidden, block)) {
            return true;
        }
    }
    return false;
}

/* An effect that was not found, of several sizes. */
static void add_sizes(sure_work_t *work, const model_t *chain, const unseen_t *unseen) {
    const block_t *block = unseen->block;
    for (size_t i = 0; i < SIZES; i++) {
        model_t with;
        const double value = instead_of_nothing(chain, unseen, sizes[i], &with);
        add_question(
            work, add_world(work, &with),
            (sure_question_t){.hidden = block, .limits = sizes[i], .parameter = unseen->parameter, .value = value});
    }
}

static void worlds_of_nothing(sure_work_t *work, const answer_t *answer) {
    model_t chain;
    size_t blocks = 0;
    instead_of_terms(answer, &chain);
    add_question(work, add_world(work, &chain), (sure_question_t){0});
    for (size_t i = 0; i < answer->unseen_count && blocks < MOST_LIMITS; i++) {
        const unseen_t *unseen = &answer->unseen[i];
        if (unseen->testable && unseen->parameter < unseen->block->parameters &&
            unseen->block->readings == READINGS_AS_THEY_ARE && !has_asked_group(work, unseen->block)) {
            add_sizes(work, &work->world[0].model, unseen);
            blocks++;
        }
    }
}

/* Whether it found an effect; steps of the converter are in all recordings that are simulated. */
static bool has_found(const answer_t *answer) {
    for (size_t f = 0; f < findings_named(answer); f++) {
        if (!answer->finding[f].in_readings) {
            return true;
        }
    }
    return false;
}

static bool has_measured_columns(const samples_t *samples) {
    bool has = false;
    for (size_t r = 0; r < samples->count; r++) {
        for (unsigned column = 0; column < COLUMN_COUNT; column++) {
            has = has || (column != COLUMN_DRIVE && column != COLUMN_DISPLACEMENT && column != COLUMN_REFERENCE &&
                          samples->recordings[r].column[column] != NULL);
        }
    }
    return has;
}

void sure_prepare(const diagnosis_run_t *run, size_t each, unsigned long seed, double took_s, sure_work_t *work) {
    const answer_t *answer = &run->answer;
    *work = (sure_work_t){.sure = {.seed = seed,
                                   .whole = answer->verdict == NOTHING_MISSING || answer->verdict == EXPLAINED,
                                   .columns = has_measured_columns(&answer->question->samples)}};
    if (has_found(answer)) {
        worlds_of_findings(work, answer);
    } else {
        worlds_of_nothing(work, answer);
    }
    const double one_s = took_s * (double)work->worlds;
    const double fitting = SURE_DEFAULT_S / fmax(one_s, 1e-3);
    work->sure.each = each > 0 ? each : (size_t)fmax(SURE_LEAST, fmin(SURE_MOST, fitting));
    work->seconds = one_s * (double)work->sure.each;
}

/* -------------------------------------------------------------------------------------------------- the asking --- */

/* NULL: the catalogue has none. */
static const block_t *block_of_noise(void) {
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->readings == READINGS_NOISY) {
            return catalogue[i];
        }
    }
    return NULL;
}

/* The converter's step of the recordings, 0 without. */
static double step_of(const answer_t *answer) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (answer->finding[f].in_readings) {
            return answer->model.block[finding_index(answer, &answer->finding[f])].parameter[0].value[0];
        }
    }
    return 0.0;
}

/* The steps' error is in the noise where it is larger than that, and is added by rounding. */
static double deviation_um(const answer_t *answer, double step_um) {
    const question_t *question = answer->question;
    const double square = question->noise.sigma_um * question->noise.sigma_um - step_um * step_um / 12.0;
    return sqrt(
        fmax(0.0, step_um > 0.0 && question->noise.filter.memory == 0.0 ? square : square + step_um * step_um / 12.0));
}

/* What the world would have shown in this recording, with other noise of the same kind (noise_filter.h). */
static bool simulate(const answer_t *answer, const model_t *world, size_t index, uint64_t seed, double *displacement,
                     failure_t *failure) {
    const question_t *question = answer->question;
    const recording_t *recording = &question->recordings[index];
    const noise_filter_t *filter = &question->noise.filter;
    const double step_um = step_of(answer);
    model_t noisy;
    double *e = allocate(recording->samples, sizeof *e), x = 0.0, last = 0.0;
    model_copy(&noisy, world);
    *model_append(&noisy, block_of_noise())->parameter[0].value = deviation_um(answer, step_um);
    const bool good = chain_simulate_finite(world, recording, seed, displacement, failure) &&
                      chain_simulate_finite(&noisy, recording, seed, e, failure);
    for (size_t k = 0; good && k < recording->samples; k++) {
        const double new = e[k] - displacement[k];
        x = k == 0 ? new *sqrt(noise_filter_gain(filter)) : filter->memory *x + new - filter->mix *last;
        last = new;
        displacement[k] += x;
        if (step_um > 0.0) {
            displacement[k] = step_um * floor(displacement[k] / step_um + 0.5);
        }
    }
    model_free(&noisy);
    free(e);
    return good;
}

static void drop_measured_columns(recording_t *recording) {
    static const column_t measured[] = {COLUMN_VOLTAGE, COLUMN_CURRENT, COLUMN_TEMPERATURE};
    for (size_t i = 0; i < sizeof measured / sizeof measured[0]; i++) {
        free(recording->column[measured[i]]);
        recording->column[measured[i]] = NULL;
    }
}

static bool names(const finding_t *finding, const block_t *block) {
    bool does = finding->block == block;
    for (size_t r = 0; r < finding->rivals; r++) {
        does = does || finding->rival[r] == block;
    }
    return does;
}

static void count_other(sure_question_t *question, const block_t *block) {
    size_t i = 0;
    while (i < question->others && question->other[i].block != block) {
        i++;
    }
    if (i < SURE_MOST_OTHERS) {
        question->other[i].block = block;
        question->other[i].count++;
        question->others += i == question->others ? 1 : 0;
    }
}

/* An answer to a recording of this world. */
static void count_answer(sure_question_t *question, const model_t *world, const answer_t *answer) {
    const finding_t *other = NULL;
    for (size_t f = 0; f < findings_named(answer); f++) {
        const finding_t *finding = &answer->finding[f];
        if (question->hidden != NULL && names(finding, question->hidden)) {
            *(finding->rivals == 0 ? &question->right : &question->open) += 1;
            return;
        }
        const bool is_there = model_find(world, finding->block->name) != NULL || finding->in_readings;
        other = other == NULL && !is_there ? finding : other;
    }
    if (other != NULL) {
        count_other(question, other->block);
    } else {
        *(question->hidden == NULL ? &question->right : &question->nothing) += 1;
    }
}

/* One set of recordings of a world, asked. */
static bool ask_once(sure_work_t *work, size_t index, size_t number, const model_t *given,
                     const recording_t *recordings, size_t count, const answer_t *answer, failure_t *failure) {
    const sure_world_t *world = &work->world[index];
    recording_t *like = allocate(count, sizeof *like);
    diagnosis_run_t run;
    bool good = true;
    for (size_t r = 0; r < count; r++) {
        const uint64_t seed = ((work->sure.seed * SURE_MOST_WORLDS + index) * 1000003U + number) * 101U + r;
        recording_copy(&like[r], &recordings[r], 0, recordings[r].samples);
        drop_measured_columns(&like[r]);
        good = good && simulate(answer, &world->model, r, seed, like[r].column[COLUMN_DISPLACEMENT], failure);
    }
    if (good) {
        good = diagnosis_run(given, like, count, SIZE_MAX, &run, failure);
    }
    if (good) {
        for (size_t q = world->from; q < world->to; q++) {
            count_answer(&work->sure.question[q], &world->model, &run.answer);
        }
        diagnosis_run_free(&run);
    }
    for (size_t r = 0; r < count; r++) {
        recording_free(&like[r]);
    }
    free(like);
    return good;
}

void sure_forget(sure_work_t *work) {
    for (size_t w = 0; w < work->worlds; w++) {
        model_free(&work->world[w].model);
    }
}

bool sure_ask(sure_work_t *work, const model_t *given, const recording_t *recordings, size_t count,
              diagnosis_run_t *run, failure_t *failure) {
    bool good = true;
    for (size_t number = 0; good && number < work->sure.each; number++) {
        for (size_t w = 0; good && w < work->worlds; w++) {
            good = ask_once(work, w, number, given, recordings, count, &run->answer, failure);
        }
    }
    sure_forget(work);
    run->sure = work->sure;
    run->sure_asked = good;
    return good;
}
