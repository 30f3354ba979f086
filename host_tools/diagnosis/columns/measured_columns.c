/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/columns/measured_columns.h"
#include "diagnosis/answer/state.h"
#include "diagnosis/columns/column_test.h"
#include "diagnosis/columns/sides.h"
#include "diagnosis/judgement/reconsider.h"
#include "elements/first_order_lag.h"
#include "numerics/golden_section.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_cblas.h>
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Time constants in parts of the longest recording. */
static const double lags[] = {0.003, 0.01, 0.03, 0.1, 0.3};
enum { LAGS = sizeof lags / sizeof lags[0], LAG_STEPS = 10 };
/* Coefficients of the voltage between which the position follows it. */

static const column_t looked_at[MEASURED_MOST] = {COLUMN_TEMPERATURE, COLUMN_VOLTAGE, COLUMN_CURRENT};

static column_relation_t relation_of(relation_t relation, const column_trial_t *trial, double lag_s) {
    return (column_relation_t){.relation = relation,
                               .coefficient = trial->coefficient,
                               .sigma = trial->sigma,
                               .lag_s = lag_s,
                               .share = trial->share,
                               .least = trial->least};
}

static column_relation_t relate(column_test_t *test, const double *column, double lag_s) {
    const column_trial_t fast = column_try(test, column, TEST_FAST), slow = column_try(test, column, TEST_SLOW_TOO);
    column_relation_t relation = relation_of(GOES_WITH_NOTHING, &fast, lag_s);
    if (fast.passed) {
        relation.relation = GOES_WITH_IT;
        relation.share = slow.share;
    } else if (slow.passed && column_drift_share(test, column) > threshold.most_of_a_drift) {
        relation = relation_of(LOOKS_LIKE_IT, &slow, lag_s);
    }
    return relation;
}

/* The temperature less that at the beginning of its recording, behind a lag. */
static void temperature(const samples_t *samples, double lag_s, double *column) {
    for (size_t i = 0; i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        const double *measured = recording->column[COLUMN_TEMPERATURE];
        first_order_stage_t behind = {.lag = {.line = {1.0}}};
        if (lag_s > 0.0) {
            first_order_lag_set(&behind.lag, 1.0 / (2.0 * M_PI * lag_s), recording->sample_rate_hz, 0);
        }
        for (size_t k = 0; k < recording->samples; k++) {
            signal_t signal = {.value = measured == NULL ? 0.0 : measured[k] - measured[0]};
            first_order_stage_step(&behind, &signal);
            column[samples->begin[i] + k] = signal.value;
        }
    }
}

typedef struct {
    column_test_t *test;
    const samples_t *samples;
    double *column;
} lag_search_t;

static double likelihood_at(const lag_search_t *search, double lag_s) {
    temperature(search->samples, lag_s, search->column);
    return column_try(search->test, search->column, TEST_FAST).likelihood;
}

static bool minus_likelihood(void *context, double log_lag_s, double *value) {
    *value = -likelihood_at(context, exp(log_lag_s));
    return true;
}

/* The lag with which the temperature explains most, 0 if none is worth its price. */
static double best_lag(const lag_search_t *search) {
    const double longest_s = samples_longest_s(search->samples);
    double best = likelihood_at(search, 0.0) + threshold.column_lag_price;
    size_t at = LAGS;
    for (size_t i = 0; i < LAGS; i++) {
        const double likelihood = likelihood_at(search, lags[i] * longest_s);
        if (likelihood > best) {
            best = likelihood;
            at = i;
        }
    }
    if (at == LAGS) {
        return 0.0;
    }
    lag_search_t context = *search;
    double lag = log(lags[at] * longest_s);
    golden_section(minus_likelihood, &context, log(lags[at > 0 ? at - 1 : 0] * longest_s),
                   log(lags[at + 1 < LAGS ? at + 1 : at] * longest_s), LAG_STEPS, &lag);
    return exp(lag);
}

/* What the position would change by if the hysteresis saw the measured voltage. */
static bool follow_voltage(const column_test_t *test, const samples_t *samples, double *column, failure_t *failure) {
    const model_t *model = column_test_model(test);
    const double *simulated = column_test_simulated(test);
    size_t order[MODEL_MAX_BLOCKS], electronics = 0;
    const size_t stages = chain_order(model, order);
    bool good = true;
    while (model->block[order[electronics]].block->place == PLACE_ELECTRONICS) {
        electronics++;
    }
    electrical_measured_voltage(samples, model, column);
    for (size_t i = 0; good && i < samples->count; i++) {
        const recording_t *recording = &samples->recordings[i];
        double *x = column + samples->begin[i];
        signal_t *signal = allocate(recording->samples + 1, sizeof *signal);
        signal[0].value = x[0];
        for (size_t k = 0; k < recording->samples; k++) {
            signal[1 + k].value = x[k];
        }
        good = chain_run(model, recording, 0, electronics, stages, signal, failure);
        for (size_t k = 0; good && k < recording->samples; k++) {
            x[k] = signal[1 + k].value - simulated[samples->begin[i] + k];
            good = isfinite(x[k]) || fail(failure, "%s: the model runs away at the measured voltage", recording->name);
        }
        free(signal);
    }
    return good;
}

static bool relate_column(column_test_t *test, const samples_t *samples, column_t which, column_relation_t *relation,
                          failure_t *failure) {
    double *column = samples_column(samples), lag_s = 0.0;
    bool good = true;
    if (which == COLUMN_TEMPERATURE) {
        const lag_search_t search = {test, samples, column};
        lag_s = best_lag(&search);
        temperature(samples, lag_s, column);
    } else if (which == COLUMN_VOLTAGE) {
        good = follow_voltage(test, samples, column, failure);
    } else {
        electrical_unexplained_current(samples, column_test_model(test), column);
    }
    if (good) {
        *relation = relate(test, column, lag_s);
    }
    if (which == COLUMN_VOLTAGE && (relation->coefficient < 1.0 / threshold.follows_voltage ||
                                    relation->coefficient > threshold.follows_voltage)) {
        relation->relation = GOES_WITH_NOTHING;
    }
    free(column);
    return good;
}

/* How much of a finding stands beside the temperature. */
static bool set_beside(column_test_t *test, const answer_t *answer, const finding_t *finding, double lag_s,
                       electrical_change_t *beside, failure_t *failure) {
    const question_t *question = answer->question;
    double *column = samples_column(&question->samples);
    model_t without;
    model_copy(&without, column_test_model(test));
    model_remove(&without, finding_index(answer, finding));
    double *signature = samples_change(&question->samples, column_test_model(test), &without, failure);
    const bool good = signature != NULL;
    if (good) {
        temperature(&question->samples, lag_s, column);
        const regression_t stands = column_beside(test, signature, column);
        *beside =
            (electrical_change_t){.measured = isfinite(stands.sigma), .part = stands.amplitude, .sigma = stands.sigma};
    }
    model_free(&without);
    free(signature);
    free(column);
    return good;
}

/* The findings beside the temperature, where what the baseline leaves goes with it. */
static bool set_all_beside(column_test_t *test, const answer_t *answer, measured_columns_t *measured,
                           failure_t *failure) {
    const column_relation_t *relation = &measured->column[0].before;
    bool good = true;
    if (measured->column[0].column != COLUMN_TEMPERATURE || relation->relation != GOES_WITH_IT) {
        return true;
    }
    for (size_t f = 0; good && f < answer->findings; f++) {
        good = answer->finding[f].in_readings || set_beside(test, answer, &answer->finding[f], relation->lag_s,
                                                            &measured->finding[f].beside_temperature, failure);
    }
    return good;
}

/* All columns against what one model leaves. */
static bool relate_all(const answer_t *answer, bool found, measured_columns_t *measured, failure_t *failure) {
    const double chance = threshold.false_relation / (2.0 * (LAGS + 1.0 + MEASURED_MOST - 1.0));
    column_test_t *test = column_test_open(answer, found ? &answer->model : &answer->baseline, chance, failure);
    bool good = test != NULL;
    for (size_t c = 0; good && c < measured->count; c++) {
        measured_column_t *column = &measured->column[c];
        good = relate_column(test, &answer->question->samples, column->column, &column->after, failure);
        column->before = found ? column->before : column->after;
    }
    good = good && (!found || set_all_beside(test, answer, measured, failure));
    column_test_close(test);
    return good;
}

bool measured_columns(const answer_t *answer, measured_columns_t *measured, failure_t *failure) {
    *measured = (measured_columns_t){0};
    for (size_t c = 0; c < MEASURED_MOST; c++) {
        if (column_measured(&answer->question->samples, looked_at[c])) {
            measured->column[measured->count++].column = looked_at[c];
        }
    }
    for (size_t f = 0; f < answer->findings && measured->count > 0; f++) {
        const finding_t *finding = &answer->finding[f];
        finding_columns_t *columns = &measured->finding[f];
        columns->block = sides_block(finding->block);
        columns->voltage = sides_change(answer, finding, COLUMN_VOLTAGE);
        columns->current = sides_change(answer, finding, COLUMN_CURRENT);
    }
    return measured->count == 0 || (relate_all(answer, false, measured, failure) &&
                                    (answer->findings == 0 || relate_all(answer, true, measured, failure)));
}

bool measured_columns_have_it(const answer_t *answer, bool *have_it, failure_t *failure) {
    measured_columns_t measured;
    *have_it = false;
    if (!measured_columns(answer, &measured, failure)) {
        return false;
    }
    for (size_t i = 0; i < measured.count; i++) {
        *have_it = *have_it || measured.column[i].after.relation == GOES_WITH_IT;
    }
    return true;
}

/* What the temperature leaves of a block must be more than nothing, and more than half. */
static bool explained_by_temperature(const finding_t *finding, const finding_columns_t *columns) {
    const electrical_change_t *beside = &columns->beside_temperature;
    return !finding->block->follows_temperature && beside->measured &&
           (beside->part < threshold.deviations * beside->sigma || electrical_verdict(beside) == CHANGE_ABSENT);
}

bool finding_contradicted(const finding_t *finding, const finding_columns_t *columns) {
    const bool anywhere = finding->block->lag == LAG_DELAY || columns->block != finding->block;
    const change_verdict_t voltage = electrical_verdict(&columns->voltage),
                           current = electrical_verdict(&columns->current);
    const bool not_there = voltage == CHANGE_ABSENT || (voltage == CHANGE_NOT_SEEN && current == CHANGE_ABSENT);
    return (!anywhere && not_there) || explained_by_temperature(finding, columns);
}

bool temperature_settle(state_t *state) {
    answer_t *answer = &state->answer;
    bool good = true, settled = !column_measured(&answer->question->samples, COLUMN_TEMPERATURE);
    while (good && !settled && answer->findings > 0) {
        measured_columns_t measured;
        size_t f = answer->findings;
        good = measured_columns(answer, &measured, state->failure);
        while (good && f > 0 && !explained_by_temperature(&answer->finding[f - 1], &measured.finding[f - 1])) {
            f--;
        }
        settled = f == 0;
        if (good && !settled) {
            good = reconsider_take_out(state, f - 1, CONTRADICTED) && findings_errors(answer, state->failure);
        }
    }
    return good;
}
