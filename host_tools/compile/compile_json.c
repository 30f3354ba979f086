/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_json.h"
#include "compile/compile.h"
#include "compile/hysteresis_text.h"
#include "hyst/cost.h"

json_t *compile_to_json(const hyst_parameters_t *p, const compile_report_t *report) {
    json_t *notes = json_array(), *uncorrected = json_array();
    json_t *json = json_pack(
        "{s:I, s:f, s:[f,f], s:[f,f], s:[f,f], s:f, s:s, s:I, s:I, s:f, s:f, s:f, s:I, s:f, s:I, s:I, s:I, s:I, s:I, "
        "s:I}",
        "model_id", (json_int_t)p->model_id, "sample_rate_hz", 1e-3 * p->sample_rate_mhz, "drive_range_v",
        drive_to_volts(p, HYST_Q31_MIN), drive_to_volts(p, HYST_Q31_MAX), "drive_limits_v",
        drive_to_volts(p, p->drive_low), drive_to_volts(p, p->drive_high), "position_range_um",
        position_to_micrometres(p, HYST_Q31_MIN), position_to_micrometres(p, HYST_Q31_MAX), "drive_park_v",
        drive_to_volts(p, p->drive_park), "hysteresis", hysteresis_name(p), "operators", (json_int_t)hysteresis_size(p),
        "model_operators", (json_int_t)report->model_operators, "merge_error_um", report->merge_error_um,
        "beta_samples", p->pi_beta * 0x1p-20, "growth_limit_v", report->growth_limit_v, "lookahead_samples",
        (json_int_t)p->lookahead_samples, "lookahead_remainder_s", report->lookahead_remainder_s, "shape_sections",
        (json_int_t)p->shape_sections, "inertia_sections", (json_int_t)p->inertia_sections, "equalise_sections",
        (json_int_t)p->equalise_sections, "creep_cells", (json_int_t)p->creep_cells, "drive_curves",
        (json_int_t)p->drive_curves, "reference_curves", (json_int_t)p->reference_curves);
    for (size_t i = 0; i < report->notes; i++) {
        json_array_append_new(notes, json_string(report->note[i]));
    }
    json_object_set_new(json, "format", json_string("hyst-compile-1"));
    json_object_set_new(json, "notes", notes);
    const uint32_t cycles = hyst_cost_cycles(p), budget = hyst_cost_budget(HYST_COST_CORE_HZ, p->sample_rate_mhz);
    json_object_set_new(json, "cost",
                        json_pack("{s:I, s:I, s:I, s:I, s:b}", "instructions", (json_int_t)hyst_cost_instructions(p),
                                  "cycles", (json_int_t)cycles, "core_hz", (json_int_t)HYST_COST_CORE_HZ,
                                  "budget_cycles", (json_int_t)budget, "fits", cycles <= budget));
    for (size_t i = 0; i < report->uncorrected; i++) {
        json_array_append_new(uncorrected, json_pack("{s:s, s:s}", "block", report->uncorrected_block[i].block, "why",
                                                     report->uncorrected_block[i].why));
    }
    json_object_set_new(json, "not_corrected", uncorrected);
    return json;
}
