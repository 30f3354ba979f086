/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/diagnose.h"
#include "base/parallel.h"
#include "diagnosis/judgement/unseen.h"
#include "diagnosis/question/baseline.h"
#include "diagnosis/review/empirical.h"
#include "diagnosis/review/review.h"
#include "diagnosis/review/seen.h"
#include "diagnosis/search/trials.h"
#include "diagnosis/stages.h"
#include <stdio.h>

/* A given chain's own answer, which stands for itself whatever hysteresis the answer has in the end. */
typedef struct {
    model_t chain;
    double nrmse_percent, held_out_percent, fitted_held_out_percent;
} as_given_t;

typedef struct shapes {
    const model_t *given; /* NULL: none */
    question_t *question; /* what blocks say beside the operator is written into it while a search goes on */
    const recording_t *recordings;
    size_t recording_count;
    /* The first one is what the search begins with: the given chain, or of the bank and the others the one that fits
     * best. */
    baseline_t shape[TRIALS_MOST_SHAPES], rough;
    size_t count; /* that are filled */
    as_given_t as_given;
    fitted_chain_t beside; /* may be empty */
    kept_chains_t kept;
} shapes_t;

static bool take_samples(question_t *question, shapes_t *shapes, failure_t *failure) {
    baseline_t *first = &shapes->shape[0];
    if (shapes->given != NULL) {
        model_copy(&first->model, shapes->given);
        model_without_noise(&first->model);
    } else if (!baseline_bank(shapes->recordings, shapes->recording_count, first, &shapes->rough, failure)) {
        return false;
    }
    shapes->count = 1;
    return question_begin(question, &first->model, shapes->recordings, shapes->recording_count, failure);
}

static bool take_noise(question_t *question, shapes_t *shapes, failure_t *failure) {
    return question_noise(question, &shapes->shape[0].model, failure);
}

/* Two fits that take the question as it is by now. Each writes what is its own: `beside`, or all else. */
typedef struct {
    const question_t *question;
    shapes_t *shapes;
    model_t operated; /* the chain with the operator: the same whatever its hysteresis is */
    failure_t *failure;
    bool good;
} first_fits_t;

static void fit_first(void *context, size_t index) {
    first_fits_t *fits = context;
    const question_t *question = fits->question;
    shapes_t *shapes = fits->shapes;
    if (index == 0) {
        (void)fitted_chain_open(&shapes->beside, &question->samples, &fits->operated, NULL);
    } else {
        fits->good =
            shapes->given != NULL || baseline_shapes(&question->samples, &question->noise, &question->setting,
                                                     shapes->shape, &shapes->rough, &shapes->count, fits->failure);
    }
}

/* The operator is fitted beside it: to what the next stage asks of it, a shape is nothing. */
static bool choose_shape(question_t *question, shapes_t *shapes, failure_t *failure) {
    first_fits_t fits = {.question = question, .shapes = shapes, .failure = failure};
    chain_for_operator(&shapes->shape[0].model, &fits.operated);
    parallel(2, fit_first, &fits);
    model_free(&fits.operated);
    return fits.good && (shapes->given != NULL || question->noise.at_rest ||
                         take_noise(question, shapes, failure)); /* with a better model, better */
}

static bool imitate(question_t *question, shapes_t *shapes, failure_t *failure) {
    (void)failure;
    question_imitate(question, &shapes->beside);
    return true;
}

static void note_given(const answer_t *answer, as_given_t *given) {
    *given = (as_given_t){.nrmse_percent = answer->given_nrmse_percent,
                          .held_out_percent = answer->given_held_out_percent,
                          .fitted_held_out_percent = answer->baseline_held_out_percent};
    model_copy(&given->chain, &answer->given);
}

/* Takes what note_given has copied. */
static void put_given(answer_t *answer, as_given_t *given) {
    model_free(&answer->given);
    answer->given = given->chain;
    given->chain = (model_t){0};
    answer->given_nrmse_percent = given->nrmse_percent;
    answer->given_held_out_percent = given->held_out_percent;
    answer->own_shape_held_out_percent = given->fitted_held_out_percent;
    if (answer->family != NULL && answer->verdict == NOTHING_MISSING) {
        answer->verdict = EXPLAINED;
    }
}

/* Two tasks that share only what neither writes: the search, and which blocks speak beside the operator. */
typedef struct {
    state_t *state;
    shapes_t *shapes;
    bool good;
} first_search_t;

static void search_first(void *context, size_t index) {
    first_search_t *search = context;
    if (index == 0) { /* this one is the caller's, and so its progress is */
        search->good = trial_of_first(search->state, &search->shapes->shape[0]);
    } else {
        question_listen(search->shapes->question, &search->shapes->beside);
    }
}

static bool search_from_first(state_t *state, shapes_t *shapes) {
    first_search_t search = {.state = state, .shapes = shapes};
    parallel(2, search_first, &search);
    if (search.good && shapes->given != NULL) {
        note_given(&state->answer, &shapes->as_given);
    }
    return search.good;
}

/* The given chain with hystereses of other shapes, behind the given one. */
static void shapes_beside_given(const question_t *question, shapes_t *shapes) {
    failure_t refusal;
    size_t count = 1;
    if (!baseline_bank(question->recordings, question->samples.count, &shapes->shape[1], &shapes->rough, &refusal)) {
        return;
    }
    baseline_shapes(&question->samples, &question->noise, &question->setting, shapes->shape + 1, &shapes->rough, &count,
                    &refusal);
    for (size_t i = 1; i <= count; i++) {
        baseline_put_into(&shapes->shape[i], &shapes->shape[0].model);
    }
    shapes->count = 1 + count;
}

static bool search_from_others(state_t *state, shapes_t *shapes) {
    if (!trial_leaves_nothing(state, &shapes->shape[0])) {
        if (shapes->given != NULL) {
            shapes_beside_given(state->answer.question, shapes);
        }
        trials_of_others(state, shapes->shape, shapes->count);
    }
    return true;
}

static bool search_without_first(state_t *state, shapes_t *shapes) {
    (void)shapes;
    trial_without_the_first(state);
    return true;
}

static bool search_richer(state_t *state, shapes_t *shapes) {
    (void)shapes;
    trial_of_richer(state);
    return true;
}

static bool search_strong(state_t *state, shapes_t *shapes) {
    trial_of_contest(state, shapes->given != NULL ? &shapes->shape[0].model : NULL, shapes->shape, shapes->count);
    return true;
}

static bool take_heard(state_t *state, shapes_t *shapes) {
    (void)shapes;
    trial_of_heard(state);
    return true;
}

static bool review(state_t *state, shapes_t *shapes) {
    const bool good = review_end(state);
    if (shapes->given != NULL) {
        put_given(&state->answer, &shapes->as_given);
        return good;
    }
    return good && (state->answer.findings > 0 || !state->answer.another_shape ||
                    trial_of_shapes_alone(state, shapes->shape, shapes->count));
}

static bool compare_with_look(state_t *state, shapes_t *shapes) {
    (void)shapes;
    return seen_compare(state);
}

static bool deliver(state_t *state, shapes_t *shapes) {
    (void)shapes;
    return review_delivered(state);
}

/* Behind that: of the model that is written, which may be a plain one in the place of the search's. */
static bool limits(state_t *state, shapes_t *shapes) {
    (void)shapes;
    if (!unseen_complete(state)) {
        return false;
    }
    unseen_beside_operator(state);
    return true;
}

static bool describe_unknown(state_t *state, shapes_t *shapes) {
    (void)shapes;
    return empirical_describe(state);
}

const stage_t diagnosis_stages[] = {
    {"samples", "which samples count, and which are held out of every fit", "noise/samples.h", .ask = take_samples},
    {"noise", "from rests, from passes of one path, or from what a rich model leaves", "noise/noise.h",
     .ask = take_noise},
    {"first shape", "of the hystereses of few numbers the one that leaves least beside every block's best probe",
     "question/baseline.h", .ask = choose_shape},
    {"universal operator", "in the hysteresis' place: what it leaves, and the noise again", "belief/shape.h",
     .ask = imitate},
    {"search",
     "block after block, until none convinces; then which stay, their names and their sides. Meanwhile, which blocks "
     "speak beside the operator",
     "search/attempt.h", .search = search_from_first},
    {"other shapes",
     "the same from other hystereses, where more than noise is left or a curve was found; the best stands",
     "search/trials.h", .search = search_from_others},
    {"without the first", "the same without the block that came first, where structure is left", "search/trials.h",
     .search = search_without_first},
    {"richer form", "the same with a block of more numbers, where structure is left and it alone explains everything",
     "search/trials.h", .search = search_richer},
    {"strong effects", "the same from the hysteresis that is best beside one strong effect, where much is left",
     "search/contest.h", .search = search_strong},
    {"heard", "what speaks beside the operator takes the answer's place if it is likelier", "search/trials.h",
     .search = take_heard},
    {"review", "findings are weighed beside the operator: what is only shape goes, and rivals are added",
     "review/review.h", .search = review},
    {"look", "what the look has shown and nothing in the answer explains is more than noise", "review/seen.h",
     .search = compare_with_look},
    {"delivered", "the error that the written model has when it is simulated; plain models beside it",
     "review/delivered.h", .search = deliver},
    {"detection limits", "of what was not found", "judgement/unseen.h", .search = limits},
    {"unknown physics", "an empirical term, where structure is left and no block explains it", "review/empirical.h",
     .search = describe_unknown},
};
const size_t diagnosis_stage_count = sizeof diagnosis_stages / sizeof diagnosis_stages[0];

bool diagnose(const model_t *given, const recording_t *recordings, size_t count, answer_t *answer, failure_t *failure) {
    return diagnose_seen(given, NULL, recordings, count, answer, failure);
}

/* heard_noise: NULL, or what the rests have beside an answer before. */
static bool diagnose_once(const model_t *given, const probe_seen_t *seen, const noise_t *heard_noise,
                          const recording_t *recordings, size_t count, answer_t *answer, failure_t *failure) {
    shapes_t shapes = {.given = given, .recordings = recordings, .recording_count = count};
    question_t *question = shapes.question = question_open(given != NULL, seen);
    state_t state = {.failure = failure, .left = 1.0, .beside = &shapes.beside, .kept = &shapes.kept};
    bool good = true;
    char doing[60];
    question->heard_noise = heard_noise != NULL ? *heard_noise : (noise_t){0};
    progress_begin(&state.progress, "diagnosing");
    for (size_t s = 0; good && s < diagnosis_stage_count; s++) {
        const stage_t *stage = &diagnosis_stages[s];
        (void)snprintf(doing, sizeof doing, "diagnosing: %s", stage->name);
        progress_name(&state.progress, doing);
        if (stage->ask != NULL) {
            good = stage->ask(question, &shapes, failure);
            state_begin(&state, question, NULL);
            state_advance(&state);
        } else {
            good = stage->search(&state, &shapes);
        }
    }
    fitted_chain_close(&shapes.beside);
    kept_chains_close(&shapes.kept);
    baseline_free(shapes.shape, shapes.count);
    baseline_free(&shapes.rough, 1);
    model_free(&shapes.as_given.chain);
    progress_end(&state.progress);
    if (state.answer.question != question) { /* asked again with other samples held out */
        question_free_shared(question);
    }
    *answer = state.answer;
    if (!progress_go_on(failure) || !good) {
        answer_free(answer);
        return false;
    }
    return true;
}

/* What was taken for noise is not looked for: a mode that rings into the rests is fitted where it rings least. */
bool diagnose_seen(const model_t *given, const probe_seen_t *seen, const recording_t *recordings, size_t count,
                   answer_t *answer, failure_t *failure) {
    enum { MOST_TIMES = 3 };
    noise_t noise;
    if (!diagnose_once(given, seen, NULL, recordings, count, answer, failure)) {
        return false;
    }
    for (int times = 1;
         times < MOST_TIMES && answer->findings > 0 && question_rests_quieter(answer->question, &answer->model, &noise);
         times++) {
        answer_free(answer);
        if (!diagnose_once(given, seen, &noise, recordings, count, answer, failure)) {
            return false;
        }
    }
    return true;
}
