/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench/twin_file.h"
#include "compile/compile.h"
#include <string.h>

/* The range of a converter from the scale numbers of an image. */
static void range_of(int32_t center, int32_t half_range, double range[2]) {
    range[0] = 1e-6 * ((double)center - (double)half_range);
    range[1] = 1e-6 * ((double)center + (double)half_range);
}

static bool set_ranges(const model_t *model, twin_options_t *twin, failure_t *failure) {
    compile_options_t options = {0};
    memcpy(options.drive_range_v, twin->drive_range_v, sizeof options.drive_range_v);
    memcpy(options.position_range_um, twin->position_range_um, sizeof options.position_range_um);
    hyst_parameters_t scales;
    if (!compile_scales(model, &options, &scales, failure)) {
        return false;
    }
    range_of(scales.drive_center_uv, scales.drive_half_range_uv, twin->drive_range_v);
    range_of(scales.position_center_pm, scales.position_half_range_pm, twin->position_range_um);
    return true;
}

twin_t *twin_from_file(const char *model_path, const twin_options_t *given, failure_t *failure) {
    model_t model;
    if (!model_read(&model, model_path, failure)) {
        return NULL;
    }
    twin_options_t options = *given;
    twin_t *twin = set_ranges(&model, &options, failure) ? twin_open(&model, &options, failure) : NULL;
    model_free(&model);
    return twin;
}
