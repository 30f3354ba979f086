/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/image_difference.h"
#include "compile/compile.h"
#include <math.h>

typedef struct {
    const hyst_parameters_t *before, *after;
    image_difference_t *to;
    size_t count;
} list_t;

static void add(list_t *list, image_difference_t difference) {
    if (list->count < IMAGE_DIFFERENCES_MOST) {
        list->to[list->count++] = difference;
    }
}

/* Whole numbers, which are equal or not. */
static void whole(list_t *list, const char *field, const char *unit, double per_unit, int64_t before, int64_t after) {
    if (before != after) {
        add(list,
            (image_difference_t){
                .field = field, .unit = unit, .before = per_unit * (double)before, .after = per_unit * (double)after});
    }
}

static void volts(list_t *list, const char *field, hyst_q31_t before, hyst_q31_t after) {
    const double volts[2] = {drive_to_volts(list->before, before), drive_to_volts(list->after, after)};
    if (before != after || volts[0] != volts[1]) {
        add(list, (image_difference_t){.field = field, .unit = "V", .before = volts[0], .after = volts[1]});
    }
}

/* A list of numbers of 32 bits, with what one of them is worth in either image. */
typedef struct {
    const char *field, *unit;
    const int32_t *number[2];
    size_t count[2];
    double worth[2];
} numbers_t;

static int32_t at(const numbers_t *n, int which, size_t index) {
    return index < n->count[which] ? n->number[which][index] : 0;
}

static void numbers(list_t *list, const numbers_t *n) {
    image_difference_t most = {.field = n->field, .unit = n->unit};
    most.count = n->count[0] > n->count[1] ? n->count[0] : n->count[1];
    double largest = -1.0;
    for (size_t i = 0; i < most.count; i++) {
        const double before = n->worth[0] * at(n, 0, i);
        const double after = n->worth[1] * at(n, 1, i);
        if (at(n, 0, i) != at(n, 1, i) || before != after) {
            most.differing++;
            if (fabs(after - before) > largest) {
                largest = fabs(after - before);
                most.before = before;
                most.after = after;
            }
        }
    }
    if (most.differing > 0) {
        add(list, most);
    }
}

static const double volts_per_uv = 1e-6;
static const double um_per_pm = 1e-6;

static void add_frame(list_t *list) {
    const hyst_parameters_t *b = list->before;
    const hyst_parameters_t *a = list->after;
    whole(list, "model_id", "", 1.0, b->model_id, a->model_id);
    whole(list, "family", "", 1.0, b->family, a->family);
    whole(list, "sample_rate_mhz", "Hz", 1e-3, b->sample_rate_mhz, a->sample_rate_mhz);
    whole(list, "drive_center_uv", "V", volts_per_uv, b->drive_center_uv, a->drive_center_uv);
    whole(list, "drive_half_range_uv", "V", volts_per_uv, b->drive_half_range_uv, a->drive_half_range_uv);
    whole(list, "position_center_pm", "um", um_per_pm, b->position_center_pm, a->position_center_pm);
    whole(list, "position_half_range_pm", "um", um_per_pm, b->position_half_range_pm, a->position_half_range_pm);
    volts(list, "drive_low", b->drive_low, a->drive_low);
    volts(list, "drive_high", b->drive_high, a->drive_high);
    volts(list, "drive_park", b->drive_park, a->drive_park);
    whole(list, "linear_offset", "of the half range", 0x1p-31, b->linear_offset, a->linear_offset);
    whole(list, "linear_gain", "", 0x1p-28, b->linear_gain, a->linear_gain);
    whole(list, "transition_slew", "of the half range a sample", 0x1p-31, b->transition_slew, a->transition_slew);
    whole(list, "lookahead_samples", "samples", 1.0, b->lookahead_samples, a->lookahead_samples);
    whole(list, "hysteresis_offset", "of the half range", 0x1p-31, b->hysteresis_offset, a->hysteresis_offset);
}

/* Records that are made of numbers of 32 bits, told as fractions of 2^bits. */
static void records(list_t *list, const char *field, size_t size, const void *before, uint32_t count_before,
                    const void *after, uint32_t count_after, double worth) {
    const size_t each = size / sizeof(int32_t);
    numbers(list, &(numbers_t){field,
                               "",
                               {(const int32_t *)before, (const int32_t *)after},
                               {each * count_before, each * count_after},
                               {worth, worth}});
}

/* um of position for each V of drive that a weight of 1 is worth. */
static double slope_of(const hyst_parameters_t *p) {
    return (double)p->position_half_range_pm / (double)p->drive_half_range_uv;
}

static void add_hysteresis(list_t *list) {
    const hyst_parameters_t *b = list->before;
    const hyst_parameters_t *a = list->after;
    const double slope[2] = {0x1p-28 * slope_of(b), 0x1p-28 * slope_of(a)};
    const double drive_v[2] = {0x1p-31 * volts_per_uv * b->drive_half_range_uv,
                               0x1p-31 * volts_per_uv * a->drive_half_range_uv};
    const double um[2] = {0x1p-28 * um_per_pm * b->position_half_range_pm,
                          0x1p-28 * um_per_pm * a->position_half_range_pm};
    whole(list, "pi_operators", "", 1.0, b->pi_operators, a->pi_operators);
    whole(list, "pi_beta", "samples", 0x1p-20, b->pi_beta, a->pi_beta);
    whole(list, "pi_rate_gain", "", 0x1p-30, b->pi_rate_gain, a->pi_rate_gain);
    numbers(list, &(numbers_t){"pi_weight",
                               "um/V",
                               {b->pi_weight, a->pi_weight},
                               {b->pi_operators + 1U, a->pi_operators + 1U},
                               {slope[0], slope[1]}});
    numbers(list, &(numbers_t){"pi_threshold",
                               "V",
                               {b->pi_threshold, a->pi_threshold},
                               {b->pi_operators, a->pi_operators},
                               {drive_v[0], drive_v[1]}});
    whole(list, "preisach_intervals", "", 1.0, b->preisach_intervals, a->preisach_intervals);
    const size_t elements[2] = {b->preisach_intervals * (b->preisach_intervals + 1U) / 2U,
                                a->preisach_intervals * (a->preisach_intervals + 1U) / 2U};
    numbers(list, &(numbers_t){"preisach_everett",
                               "um",
                               {b->preisach_everett, a->preisach_everett},
                               {elements[0], elements[1]},
                               {um[0], um[1]}});
    whole(list, "bouc_wen_cells", "", 1.0, b->bouc_wen_cells, a->bouc_wen_cells);
    whole(list, "bouc_wen_direct", "um/V", slope[0], b->bouc_wen_direct, a->bouc_wen_direct);
    numbers(list, &(numbers_t){"bouc_wen_length",
                               "V",
                               {b->bouc_wen_length, a->bouc_wen_length},
                               {b->bouc_wen_cells, a->bouc_wen_cells},
                               {drive_v[0], drive_v[1]}});
    numbers(list, &(numbers_t){"bouc_wen_slope",
                               "um/V",
                               {b->bouc_wen_slope, a->bouc_wen_slope},
                               {b->bouc_wen_cells, a->bouc_wen_cells},
                               {slope[0], slope[1]}});
    whole(list, "modified_plays", "", 1.0, b->modified_plays, a->modified_plays);
    records(list, "modified_play", sizeof b->modified_play[0], b->modified_play, b->modified_plays, a->modified_play,
            a->modified_plays, 1.0);
}

static void add_filters(list_t *list) {
    const hyst_parameters_t *b = list->before;
    const hyst_parameters_t *a = list->after;
    whole(list, "drive_curves", "", 1.0, b->drive_curves, a->drive_curves);
    records(list, "drive_curve", sizeof b->drive_curve[0], b->drive_curve, b->drive_curves, a->drive_curve,
            a->drive_curves, 0x1p-31);
    whole(list, "reference_curves", "", 1.0, b->reference_curves, a->reference_curves);
    records(list, "reference_curve", sizeof b->reference_curve[0], b->reference_curve, b->reference_curves,
            a->reference_curve, a->reference_curves, 0x1p-31);
    whole(list, "shape_sections", "", 1.0, b->shape_sections, a->shape_sections);
    records(list, "shape", sizeof b->shape[0], b->shape, b->shape_sections, a->shape, a->shape_sections, 0x1p-28);
    whole(list, "inertia_sections", "", 1.0, b->inertia_sections, a->inertia_sections);
    records(list, "inertia", sizeof b->inertia[0], b->inertia, b->inertia_sections, a->inertia, a->inertia_sections,
            0x1p-28);
    whole(list, "equalise_sections", "", 1.0, b->equalise_sections, a->equalise_sections);
    records(list, "equalise", sizeof b->equalise[0], b->equalise, b->equalise_sections, a->equalise,
            a->equalise_sections, 0x1p-28);
    whole(list, "creep_cells", "", 1.0, b->creep_cells, a->creep_cells);
    records(list, "creep", sizeof b->creep[0], b->creep, b->creep_cells, a->creep, a->creep_cells, 0x1p-31);
}

size_t image_differences(const hyst_parameters_t *before, const hyst_parameters_t *after,
                         image_difference_t difference[IMAGE_DIFFERENCES_MOST]) {
    list_t list = {.before = before, .after = after, .to = difference};
    add_frame(&list);
    add_hysteresis(&list);
    add_filters(&list);
    return list.count;
}
