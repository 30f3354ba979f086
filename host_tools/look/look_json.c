/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/look_json.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

static json_t *share_to_json(const noise_share_t *share) {
    if (share->samples == 0) {
        return json_null();
    }
    return json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:f, s:I}", "samples", (json_int_t)share->samples, "rms_um",
                     share->rms_um, "white_um", share->white_um, "slow_um", share->slow_um, "other_um", share->other_um,
                     "lowest_hz", share->lowest_hz, "kurtosis", share->kurtosis, "outliers",
                     (json_int_t)share->outliers);
}

static json_t *drive_to_json(const look_t *look) {
    const drive_look_t *d = &look->drive;
    const double rate_hz = look->recording->sample_rate_hz;
    const char *moved = recording_key(look->recording, "drive_moved_s");
    json_t *json =
        json_pack("{s:s, s:[f, f], s:I, s:f, s:I, s:I, s:I, s:s, s:s, s:[f, f]}", "kind", drive_kind_name(d->kind),
                  "range_v", d->range_v[0], d->range_v[1], "rests", (json_int_t)d->rests, "rest_s", d->rest_s, "steps",
                  (json_int_t)d->steps, "levels", (json_int_t)d->levels, "held_samples", (json_int_t)d->held_samples,
                  "between_samples", drive_between_name(d->between), "between_samples_from",
                  d->between_given                ? "header"
                  : d->between == BETWEEN_UNKNOWN ? "nothing"
                                                  : "data",
                  "frequency_hz", d->frequency_hz[0], d->frequency_hz[1]);
    json_object_set_new(json, "moved_s", moved != NULL ? json_real(strtod(moved, NULL)) : json_null());
    json_object_set_new(json, "step_v", d->step_v > 0.0 ? json_real(d->step_v) : json_null());
    json_object_set_new(json, "noise_v", d->noise_v > 0.0 ? json_real(d->noise_v) : json_null());
    json_object_set_new(json, "period_s", d->period > 0.0 ? json_real(d->period / rate_hz) : json_null());
    json_object_set_new(json, "periods", json_integer((json_int_t)drive_periods(d)));
    json_object_set_new(json, "repeats_s",
                        d->period > 0.0 ? json_pack("[f, f]", recording_time(look->recording, (double)d->repeat.from),
                                                    recording_time(look->recording, (double)d->repeat.to))
                                        : json_null());
    return json;
}

static json_t *map_to_json(const static_map_t *map) {
    json_t *level = json_array(), *rising = json_array(), *falling = json_array();
    for (size_t i = 0; i < map->levels; i++) {
        json_array_append_new(level, json_real(map->level_v[i]));
        json_array_append_new(rising, json_real(map->rising_um[i]));
        json_array_append_new(falling, json_real(map->falling_um[i]));
    }
    return json_pack("{s:f, s:f, s:[f, f], s:f, s:f, s:f, s:o, s:o, s:o}", "gain_um_per_v", map->gain_um_per_v,
                     "offset_um", map->offset_um, "range_um", map->stroke_um[0], map->stroke_um[1],
                     "line_error_percent", map->line_error_percent, "loop_width_percent", map->width_percent,
                     "bend_percent", map->bend_percent, "drive_v", level, "rising_um", rising, "falling_um", falling);
}

static json_t *repetition_to_json(const look_t *look) {
    const repetition_t *r = &look->repetition;
    const double rate_hz = look->recording->sample_rate_hz;
    json_t *at = json_array(), *lag = json_array(), *offset = json_array(), *gain = json_array();
    if (r->count == 0) {
        json_decref(at);
        json_decref(lag);
        json_decref(offset);
        json_decref(gain);
        return json_null();
    }
    for (size_t i = 0; i < r->passes; i++) {
        json_array_append_new(at, json_real(recording_time(look->recording, (double)r->pass[i].at)));
        json_array_append_new(lag, json_real(r->pass[i].lag / rate_hz));
        json_array_append_new(offset, json_real(r->pass[i].offset_um));
        json_array_append_new(gain, json_real(r->pass[i].gain));
    }
    return json_pack("{s:f, s:f, s:o, s:o, s:o, s:o}", "rms_um", r->rms_um, "worst_um", r->worst_um, "pass_s", at,
                     "lag_s", lag, "offset_um", offset, "gain", gain);
}

static json_t *response_to_json(const response_t *response) {
    json_t *points = json_array();
    for (size_t i = 0; i < response->count; i++) {
        const response_point_t *p = &response->point[i];
        json_array_append_new(points, json_pack("{s:f, s:f, s:o, s:f, s:o, s:f, s:f}", "frequency_hz", p->frequency_hz,
                                                "gain_um_per_v", p->gain_um_per_v, "gain_sigma",
                                                json_number_or_null(p->gain_sigma), "phase_rad", p->phase_rad,
                                                "phase_sigma", json_number_or_null(p->phase_sigma), "coherence",
                                                p->coherence, "lag_s", p->lag_s));
    }
    return json_pack("{s:s, s:o, s:o}", "method", response->periodic ? "periodic" : "local polynomial", "points",
                     points, "goes_on_to_hz",
                     response->goes_on_to_hz > 0.0 ? json_real(response->goes_on_to_hz) : json_null());
}

static json_t *ring_to_json(const look_t *look) {
    const ring_t *ring = &look->ring;
    if (ring->rings == 0) {
        return json_null();
    }
    return json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:f, s:f}", "steps", (json_int_t)ring->rings, "strongest_s",
                     recording_time(look->recording, (double)ring->at), "step_v", ring->step_v, "swing_um",
                     ring->swing_um, "frequency_hz", ring->frequency_hz, "frequency_sigma_hz", ring->frequency_sigma_hz,
                     "damping_ratio", ring->damping, "damping_sigma", ring->damping_sigma);
}

static json_t *holds_to_json(const look_t *look) {
    const holds_t *holds = &look->holds;
    json_t *list = json_array();
    for (size_t i = 0; i < holds->count; i++) {
        const hold_t *h = &holds->hold[i];
        json_array_append_new(list, json_pack("{s:[f, f], s:f, s:f, s:f, s:f, s:f, s:f}", "time_s",
                                              recording_time(look->recording, (double)h->span.from),
                                              recording_time(look->recording, (double)h->span.to), "decades",
                                              h->decades, "slope_um_per_decade", h->slope_um, "slope_sigma_um",
                                              h->slope_sigma_um, "change_before_um", h->before_um, "bend_um",
                                              h->bend_um, "bend_sigma_um", h->bend_sigma_um));
    }
    return json_pack("{s:o, s:o, s:o}", "holds", list, "creep_per_decade",
                     holds->creep_sigma > 0.0 ? json_real(holds->creep) : json_null(), "creep_sigma",
                     holds->creep_sigma > 0.0 ? json_real(holds->creep_sigma) : json_null());
}

static json_t *rails_to_json(const rails_t *rails) {
    return json_pack("{s:o, s:o}", "low_v", rails->low ? json_real(rails->low_v) : json_null(), "high_v",
                     rails->high ? json_real(rails->high_v) : json_null());
}

static json_t *look_to_json(const look_t *look) {
    const noise_look_t *noise = &look->noise;
    json_t *json =
        json_pack("{s:s, s:I, s:f, s:f, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "recording", look->recording->name,
                  "samples", (json_int_t)look->recording->samples, "sample_rate_hz", look->recording->sample_rate_hz,
                  "start_s", look->recording->start_s, "drive", drive_to_json(look), "static", map_to_json(&look->map),
                  "repetition", repetition_to_json(look), "response", response_to_json(&look->response), "ring",
                  ring_to_json(look), "creep", holds_to_json(look), "rails", rails_to_json(&look->rails));
    json_object_set_new(json, "noise",
                        json_pack("{s:o, s:o, s:f, s:o}", "rest", share_to_json(&noise->rest), "repetition",
                                  share_to_json(&noise->repeat), "neighbours_um", look->prediction.noise_um,
                                  "converter_step_um", noise->step_um > 0.0 ? json_real(noise->step_um) : json_null()));
    return json;
}

static json_t *spans_to_json(const fault_t *fault, const recording_t *recording) {
    json_t *list = json_array();
    for (size_t i = 0; i < fault->spans; i++) {
        json_array_append_new(list, json_pack("[f, f]", recording_time(recording, (double)fault->span[i].from),
                                              recording_time(recording, (double)fault->span[i].to)));
    }
    return list;
}

json_t *fault_to_json(const look_t *looks, const fault_t *fault) {
    const recording_t *recording = looks[fault->recording].recording;
    json_t *parameters = json_object();
    for (size_t i = 0; i < fault->numbers; i++) {
        const fault_number_t *n = &fault->number[i];
        json_object_set_new(
            parameters, n->name,
            json_pack("{s:f, s:o, s:s}", "value", n->value, "sigma", json_number_or_null(n->sigma), "unit", n->unit));
    }
    return json_pack("{s:s, s:s, s:s, s:f, s:o, s:{s:s, s:o}, s:I, s:s, s:s, s:f, s:f, s:b, s:s, s:[], s:s}", "block",
                     fault->kind->name, "place", "recording", "certainty", "named", "confidence",
                     threshold.never_certain, "parameters", parameters, "where", "recording", recording->name, "time_s",
                     spans_to_json(fault, recording), "samples", (json_int_t)fault_samples(fault, looks), "handling",
                     fault_handling_name(fault->kind->handling), "statistic", fault->kind->statistic, "evidence",
                     fault->evidence, "log10_chance", fmax(fault->log_chance, -300.0), "undone", fault->undone,
                     "explanation", fault->kind->text, "confusable_with", "separating_excitation", fault->kind->change);
}

json_t *looks_to_json(const look_t *looks, size_t count, const fault_list_t *faults) {
    json_t *recordings = json_array(), *list = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(recordings, look_to_json(&looks[i]));
    }
    for (size_t i = 0; i < faults->count; i++) {
        json_array_append_new(list, fault_to_json(looks, &faults->fault[i]));
    }
    return json_pack("{s:o, s:o}", "recordings", recordings, "faults", list);
}

void looks_into_diagnosis(json_t *diagnosis, const look_t *looks, size_t count, const fault_list_t *faults,
                          size_t masked) {
    json_t *look = looks_to_json(looks, count, faults), *findings = json_object_get(diagnosis, "findings");
    json_object_set_new(look, "masked_samples", json_integer((json_int_t)masked));
    json_object_set_new(diagnosis, "look", look);
    for (size_t i = 0; i < faults->count; i++) {
        json_array_insert_new(findings, i, fault_to_json(looks, &faults->fault[i]));
    }
}
