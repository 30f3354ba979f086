/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "twin_options.h"
#include "compile.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool read_resonance(twin_settings_t *settings) {
    char *end = NULL;
    twin_options_t *twin = &settings->twin;
    twin->resonance_hz = strtod(settings->resonance, &end);
    if (*end != ':') {
        return false;
    }
    twin->resonance_damping = strtod(end + 1, &end);
    return *end == '\0' && isfinite(twin->resonance_hz) && twin->resonance_hz > 0.0 &&
           isfinite(twin->resonance_damping);
}

int twin_options_check(const command_t *command, twin_settings_t *settings) {
    twin_options_t *twin = &settings->twin;
    if (settings->resonance != NULL && !read_resonance(settings)) {
        return usage_error(command, "--resonance %s: not HZ:ZETA, such as 2000:0.02", settings->resonance);
    }
    if (strcmp(settings->speed, "realtime") != 0 && strcmp(settings->speed, "fast") != 0) {
        return usage_error(command, "--speed %s: not realtime or fast", settings->speed);
    }
    if (!(twin->sample_rate_hz > 0.0)) {
        return usage_error(command, "--sample-rate %g: must be positive", twin->sample_rate_hz);
    }
    if (twin->substeps < 1 || twin->substeps > 1000) {
        return usage_error(command, "--substeps %lu: outside 1..1000", twin->substeps);
    }
    if (twin->noise_um < 0.0) {
        return usage_error(command, "--noise-um %g: must not be negative", twin->noise_um);
    }
    twin->real_time = strcmp(settings->speed, "realtime") == 0;
    return OPTIONS_RUN;
}

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

twin_t *twin_from_file(const char *model_path, const twin_settings_t *settings, failure_t *failure) {
    model_t model;
    if (!model_read(&model, model_path, failure)) {
        return NULL;
    }
    twin_options_t options = settings->twin;
    twin_t *twin = set_ranges(&model, &options, failure) ? twin_open(&model, &options, failure) : NULL;
    model_free(&model);
    return twin;
}

void twin_print_run(const twin_run_t *run, const twin_settings_t *settings) {
    const double rate_hz = run->seconds > 0.0 ? (double)run->samples / run->seconds : 0.0;
    (void)fprintf(stderr,
                  "twin: %lu samples in %.2f s, %.0f samples/s, %.2f times real time; %lu repeated at the start\n",
                  run->samples, run->seconds, rate_hz, rate_hz / settings->twin.sample_rate_hz, run->repetitions);
}
