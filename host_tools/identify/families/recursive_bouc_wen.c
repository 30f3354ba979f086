/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Family `recursive_bouc_wen`: Bouc-Wen hysteresis with the recursion and the harmonics of paper 001 behind it, which
 * stands for the "enhanced Bouc-Wen model" that the paper compares with and does not print. One sinusoidal recording.
 * docs/MODELS.md, section 8.
 */
#include "chain/catalogue.h"
#include "elements/bouc_wen.h"
#include "identify/families/modified_play.h"
#include "identify/recursion_fit.h"
#include <math.h>

enum { BETA, RATIO, EXPONENT, SHAPES };
enum { DIRECT, HYSTERETIC, COLUMNS };

/* From the search's scale: beta > 0, |gamma| < beta, 1 < exponent < 5. */
static bouc_wen_t model_of(const double *shape) {
    bouc_wen_t model;
    const double beta = exp(shape[BETA]);
    bouc_wen_open(&model, beta, beta * tanh(shape[RATIO]), 3.0 + 2.0 * tanh(shape[EXPONENT]));
    return model;
}

/*
 * A ceramic lags behind its drive: h counts against the drive, which has to outweigh it. h rises with the drive by at
 * most 1 (at h = 0) or 2 beta / (beta + gamma) (after a reversal at the limit). So the column is m u - h, with m just
 * above, and a weight of 0 or more is a loop that rises on every branch.
 */
static double outweighing(const bouc_wen_t *model) {
    return 1.01 * fmax(1.0, 2.0 * model->beta / (model->beta + model->gamma));
}

static void open(void *state, const double *shape) {
    *(bouc_wen_t *)state = model_of(shape);
}

static void step(void *state, double u, double *column) {
    column[DIRECT] = u;
    column[HYSTERETIC] = outweighing(state) * u - bouc_wen_step(state, u);
}

static bool fit_with(const family_job_t *job, bool invertible, model_t *model, family_notes_t *notes,
                     failure_t *failure) {
    static const double lower[COLUMNS] = {0.0, 0.0};
    recursion_problem_t problem;
    recursion_estimate_t one_step, simulation;
    bouc_wen_t state;
    if (!recursion_problem(job, "recursive_bouc_wen", &problem, failure)) {
        return false;
    }
    problem.invertible = invertible;
    problem.basis = (recursion_basis_t){.columns = COLUMNS,
                                        .lower = lower,
                                        .shapes = SHAPES,
                                        .shape_start = {[BETA] = 0.0, [RATIO] = 0.0, [EXPONENT] = -1.0},
                                        .open = open,
                                        .step = step,
                                        .state = &state};
    if (!recursion_fit_one_step(&problem, &one_step, failure) ||
        !recursion_fit_simulation(&problem, &simulation, failure)) {
        return false;
    }
    const bouc_wen_t found = model_of(simulation.shape);
    model_create(model, problem.recording->sample_rate_hz);
    model_block_t *block = model_append(model, &block_bouc_wen);
    recursion_set(block, &problem, &simulation);
    model_set(block, "direct_um", simulation.weight[DIRECT] + outweighing(&found) * simulation.weight[HYSTERETIC]);
    model_set(block, "hysteretic_um", -simulation.weight[HYSTERETIC]);
    model_set(block, "beta", found.beta);
    model_set(block, "gamma", found.gamma);
    model_set(block, "exponent", found.exponent);
    recursion_report(model, notes, &one_step, &simulation);
    return true;
}

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return fit_with(job, true, model, notes, failure);
}

static bool fit_freely(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return fit_with(job, false, model, notes, failure);
}

const family_t family_recursive_bouc_wen = {.name = "recursive_bouc_wen",
                                            .order = 120,
                                            .text = "Bouc-Wen hysteresis, recursion, harmonics; one sine",
                                            .fit = fit,
                                            .one_sine = true};

const family_t family_free_bouc_wen = {.name = "free_bouc_wen",
                                       .text = "the same with weights of any sign; one sine",
                                       .fit = fit_freely,
                                       .one_sine = true};
