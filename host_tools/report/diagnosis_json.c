/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/diagnosis_json.h"
#include "base/json_output.h"
#include "chain/catalogue.h"
#include "diagnosis/evidence/searched.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/question/excerpt.h"
#include "report/diagnosis_text.h"
#include "report/measured_columns_text.h"
#include "report/taken_out_text.h"
#include <math.h>

static json_t *ranges_to_json(const ranges_t *ranges) {
    json_t *list = json_array();
    for (size_t i = 0; i < ranges->count; i++) {
        json_array_append_new(list, json_pack("[f, f]", ranges->range[i].from, ranges->range[i].to));
    }
    return list;
}

static json_t *location_to_json(const location_t *location, const recording_t *recordings) {
    json_t *json = json_pack("{s:o, s:o, s:o, s:o, s:s}", "time_s", ranges_to_json(&location->time_s), "frequency_hz",
                             ranges_to_json(&location->frequency_hz), "drive", ranges_to_json(&location->drive_v),
                             "drive_rate_v_per_s", ranges_to_json(&location->drive_rate_v_per_s), "loop",
                             loop_part_name(location->loop));
    if (location->somewhere) {
        json_object_set_new(json, "recording", json_string(recordings[location->recording].name));
    }
    if (location->fundamental_hz > 0.0) {
        json_t *numbers = json_array();
        for (size_t i = 0; i < location->harmonics; i++) {
            json_array_append_new(numbers, json_integer((json_int_t)location->harmonic[i]));
        }
        json_object_set_new(json, "harmonics",
                            json_pack("{s:f, s:o}", "fundamental_hz", location->fundamental_hz, "numbers", numbers));
    }
    return json;
}

static json_t *parameters_to_json(const answer_t *answer, const finding_t *finding) {
    const model_block_t *block = &answer->model.block[finding_index(answer, finding)];
    json_t *parameters = json_object();
    for (size_t p = 0; p < block->block->parameters; p++) {
        const parameter_t *parameter = &block->parameter[p];
        if (number_is_told(block, p)) {
            json_object_set_new(
                parameters, block->block->parameter[p].name,
                json_pack("{s:f, s:o, s:s}", "value", parameter->value[0], "sigma",
                          parameter->sigma == NULL ? json_null() : json_number_or_null(parameter->sigma[0]), "unit",
                          block->block->parameter[p].unit));
        }
    }
    return parameters;
}

static json_t *finding_to_json(const answer_t *answer, const account_t *account, size_t index,
                               const recording_t *recordings) {
    const finding_t *finding = &answer->finding[index];
    char explanation[DIAGNOSIS_LINE];
    json_t *confusable = json_array();
    finding_explanation(finding, explanation);
    for (size_t i = 0; i < finding->rivals; i++) {
        json_array_append_new(confusable, json_string(finding->rival[i]->name));
    }
    json_t *json =
        json_pack("{s:s, s:s, s:s, s:f, s:o, s:o, s:o, s:o, s:s, s:o, s:s}", "block", finding->block->name, "place",
                  place_name(finding->block->place), "certainty", certainty_name(finding->certainty), "confidence",
                  account->confidence[index], "parameters", parameters_to_json(answer, finding),
                  "held_out_nrmse_percent_before", json_number_or_null(finding->held_out_before_percent),
                  "held_out_nrmse_percent_after", json_number_or_null(finding->held_out_after_percent), "where",
                  location_to_json(&account->where[index], recordings), "explanation", explanation, "confusable_with",
                  confusable, "separating_excitation", block_search(finding->block)->excitation);
    double time_s[2];
    if (finding_times(answer, finding, time_s)) {
        json_object_set_new(json, "valid_s", json_pack("[f, f]", time_s[0], time_s[1]));
    }
    if (finding_is_empirical(finding)) {
        json_object_set_new(json, "empirical", json_true());
    }
    if (finding->heard) {
        json_object_set_new(json, "beside_operator", json_true());
    }
    json_t *measured = finding_columns_to_json(&account->measured.finding[index]);
    if (measured != NULL) {
        json_object_set_new(json, "measured", measured);
    }
    return json;
}

/* Errors on the samples that are fitted and on those that are held out. */
static json_t *errors_to_json(double percent, double held_out_percent) {
    return json_pack("{s:o, s:o}", "nrmse_percent", json_number_or_null(percent), "held_out_nrmse_percent",
                     json_number_or_null(held_out_percent));
}

static json_t *unseen_to_json(const unseen_t *unseen, bool limits) {
    const block_t *block = unseen->block;
    json_t *parameter = json_null();
    const bool has_limit = unseen->testable && limits;
    if (has_limit && unseen_has_parameter(unseen)) {
        const parameter_info_t *info = &block->parameter[unseen->parameter];
        parameter = json_pack("{s:s, s:f, s:s}", "name", info->name, "value", fabs(unseen->value), "unit", info->unit);
    }
    return json_pack("{s:s, s:b, s:s?, s:o, s:o, s:s, s:o}", "block", block->name, "testable", (int)unseen->testable,
                     "reason", unseen->why, "smallest_um",
                     has_limit ? json_number_or_null(unseen->smallest_um) : json_null(), "parameter", parameter,
                     "separating_excitation", block->probe->excitation, "probe",
                     json_sprintf("hyst record --probe %s", block->name));
}

static json_t *all_unseen_to_json(const answer_t *answer) {
    const unseen_t *unseen[DIAGNOSIS_MOST_UNSEEN];
    size_t testable;
    const size_t count = unseen_in_order(answer, unseen, &testable);
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(list, unseen_to_json(unseen[i], unseen_has_limits(answer)));
    }
    return list;
}

/* What the look saw ring and nothing in the answer does. */
static json_t *ring_left_to_json(const answer_t *answer) {
    const probe_seen_t *seen = &answer->question->seen;
    return answer->ring_left_um > 0.0 ? json_pack("{s:f, s:f, s:f}", "frequency_hz", seen->ring_hz, "damping_ratio",
                                                  seen->ring_damping, "swing_um", answer->ring_left_um)
                                      : json_null();
}

static json_t *remaining_to_json(const answer_t *answer, const account_t *account, const recording_t *recordings) {
    const remainder_t *remainder = &answer->remainder;
    json_t *json = errors_to_json(answer->nrmse_percent, answer->held_out_percent);
    json_object_set_new(json, "simulated_nrmse_percent", json_number_or_null(answer->delivered_percent));
    json_object_set_new(json, "noise_floor_percent", json_number_or_null(answer->noise_percent));
    json_object_set_new(json, "past_unknown", json_boolean(answer->question->samples.past_matters));
    json_object_set_new(json, "taken_out", taken_out_to_json(account, recordings));
    json_object_set_new(json, "structured", json_boolean(something_remains(answer)));
    json_object_set_new(json, "rms_um", json_number_or_null(remainder->rms_um));
    json_object_set_new(json, "band_hz",
                        remainder->high_hz > 0.0 ? json_pack("[f, f]", remainder->low_hz, remainder->high_hz)
                                                 : json_null());
    json_object_set_new(json, "outliers", json_integer((json_int_t)remainder->outliers));
    json_object_set_new(json, "ring", ring_left_to_json(answer));
    json_object_set_new(json, "by_level", json_real(remainder->by_level.part));
    json_object_set_new(json, "levels_um",
                        remainder->by_level.part > 0.0
                            ? json_pack("[f, f]", remainder->by_level.low_um, remainder->by_level.high_um)
                            : json_null());
    json_object_set_new(json, "where", location_to_json(&account->remaining, recordings));
    return json;
}

static json_t *other_shape_to_json(const answer_t *answer) {
    const model_t *given = &answer->given;
    return json_pack("{s:s, s:s, s:o}", "block", diagnosis_other_shape(answer)->name, "instead_of",
                     given->block[hysteresis_index(given)].block->name, "held_out_nrmse_percent_with_that",
                     json_number_or_null(answer->own_shape_held_out_percent));
}

/* What the drive does between samples, as the answer takes it. */
static json_t *between_to_json(const answer_t *answer) {
    const recording_t *first = &answer->question->samples.recordings[0];
    drive_between_t said;
    failure_t ignored;
    const bool known = recording_drive_between(first, &said, &ignored) && said != BETWEEN_UNKNOWN;
    return json_pack("{s:b, s:o, s:s}", "held", (int)first->held, "displacement_sampled_after_s",
                     first->held ? json_real(first->held_since / first->sample_rate_hz) : json_null(), "from",
                     !first->held ? "interpolation"
                     : known      ? "header"
                                  : "data");
}

static json_t *shape_to_json(const answer_t *answer) {
    const shape_t *shape = &answer->question->shape;
    return json_pack("{s:b, s:o, s:o, s:o, s:f, s:o, s:i, s:b, s:b, s:o, s:o}", "explains", (int)shape->whole,
                     "operator_held_out_nrmse_percent", json_number_or_null(shape->operator_percent), "noise_percent",
                     json_number_or_null(shape->noise_percent), "noise_corner_hz", json_number_or_null(shape->rho_hz),
                     "not_determined_percent", 100.0 * shape->not_determined, "held_out_over_noise",
                     json_number_or_null(shape->deviations), "outliers", (int)shape->outliers, "turns_between_samples",
                     (int)shape->turns, "duhem_law", (int)shape->law, "loudest_block",
                     shape->loudest != NULL ? json_string(shape->loudest->name) : json_null(), "loudest_gain",
                     json_number_or_null(shape->gain));
}

static json_t *refitted_to_json(const answer_t *answer) {
    json_t *numbers = json_array();
    for (size_t i = 0; i < answer->refitted; i++) {
        const block_t *block = answer->refitted_block[i];
        const model_block_t *was = model_find(&answer->given, block->name);
        const model_block_t *is = model_find(&answer->model, block->name);
        for (size_t p = 0; p < block->parameters; p++) {
            if (number_is_searched(is, p)) {
                const double sigma = is->parameter[p].sigma != NULL ? is->parameter[p].sigma[0] : HUGE_VAL;
                json_array_append_new(
                    numbers, json_pack("{s:s, s:s, s:f, s:f, s:o, s:s, s:b}", "block", block->name, "parameter",
                                       block->parameter[p].name, "given", was->parameter[p].value[0], "value",
                                       is->parameter[p].value[0], "sigma", json_number_or_null(sigma), "unit",
                                       block->parameter[p].unit, "changed", (int)refitted_changed(was, is, p)));
            }
        }
    }
    return numbers;
}

/* What was used of each recording, where that was not all. */
static json_t *used_to_json(const recording_t *recordings, size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        const recording_t *r = &recordings[i];
        const size_t of = excerpt_mean_of(r);
        if (r->whole != NULL) {
            json_array_append_new(list, json_pack("{s:s, s:I, s:I, s:I, s:[f, f]}", "recording", r->name, "samples",
                                                  (json_int_t)r->samples * (json_int_t)of, "of_samples",
                                                  (json_int_t)r->whole->samples, "mean_of", (json_int_t)of, "time_s",
                                                  recording_time(r, 0.0), recording_time(r, (double)r->samples)));
        }
    }
    return list;
}

json_t *diagnosis_to_json(const answer_t *answer, const account_t *account, const recording_t *recordings,
                          size_t count) {
    const question_t *question = answer->question;
    const bool was_given = question->model_given;
    char caveat[DIAGNOSIS_LINE];
    const bool doubtful = verdict_caveat(answer, caveat);
    json_t *names = json_array(), *findings = json_array(), *model = model_to_json(&answer->baseline);
    json_t *baseline = json_pack("{s:O, s:o, s:o}", "chain", json_object_get(model, "chain"), "nrmse_percent",
                                 json_number_or_null(answer->baseline_nrmse_percent), "held_out_nrmse_percent",
                                 json_number_or_null(answer->baseline_held_out_percent));
    json_decref(model);
    json_object_set_new(baseline, "simulated_nrmse_percent", json_number_or_null(answer->baseline_delivered_percent));
    json_object_set_new(baseline, "straight_line_nrmse_percent", json_number_or_null(answer->line_percent));
    json_object_set_new(baseline, "plays_nrmse_percent", json_number_or_null(answer->plays_percent));
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(names, json_string(recordings[i].name));
    }
    for (size_t f = 0; f < answer->findings; f++) {
        json_array_append_new(findings, finding_to_json(answer, account, f, recordings));
    }
    json_t *json = json_pack(
        "{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:s, s:s?}", "format", "hyst-diagnosis-1", "recordings", names, "given",
        was_given ? errors_to_json(answer->given_nrmse_percent, answer->given_held_out_percent) : json_null(),
        "baseline", baseline, "findings", findings, "not_found", all_unseen_to_json(answer), "remaining",
        remaining_to_json(answer, account, recordings), "verdict", verdict_name(answer->verdict), "caveat",
        doubtful ? caveat : NULL);
    json_t *used = used_to_json(recordings, count);
    if (json_array_size(used) > 0) {
        json_object_set(json, "used", used);
    }
    json_decref(used);
    if (diagnosis_other_shape(answer) != NULL) {
        json_object_set_new(json, "other_shape", other_shape_to_json(answer));
    }
    json_object_set_new(json, "between_samples", between_to_json(answer));
    if (question->shape.fitted) {
        json_object_set_new(json, "shape", shape_to_json(answer));
    }
    if (answer->refitted > 0) {
        json_object_set_new(json, "refitted", refitted_to_json(answer));
    }
    json_t *each = each_to_json(account, recordings);
    if (each != NULL) {
        json_object_set_new(json, "each", each);
    }
    if (account->measured.count > 0) {
        json_object_set_new(json, "measured_columns", measured_columns_to_json(&account->measured));
    }
    return json;
}

bool diagnosis_write_json(const answer_t *answer, const account_t *account, const recording_t *recordings, size_t count,
                          const char *path, failure_t *failure) {
    return json_write(diagnosis_to_json(answer, account, recordings, count), path, failure);
}
