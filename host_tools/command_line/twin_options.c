/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/twin_options.h"
#include "bench/firmware_file.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool read_mode(const char *text, double *frequency_hz, double *damping) {
    char *end = NULL;
    *frequency_hz = strtod(text, &end);
    if (*end != ':') {
        return false;
    }
    *damping = strtod(end + 1, &end);
    return *end == '\0' && isfinite(*frequency_hz) && *frequency_hz > 0.0 && isfinite(*damping);
}

/* What happens to the twin while it runs. */
static int check_events(const command_t *command, twin_settings_t *settings) {
    twin_options_t *twin = &settings->twin;
    if (settings->load != NULL && !read_mode(settings->load, &twin->load_hz, &twin->load_damping)) {
        return usage_error(command, "--load %s: not HZ:ZETA, such as 250:0.02", settings->load);
    }
    if ((settings->load != NULL) != !isnan(settings->load_at_s) || settings->load_at_s < 0.0) {
        return usage_error(command, "--load HZ:ZETA and --load-at S belong together, and S is not negative");
    }
    if (isnan(settings->sag_v) != isnan(settings->sag_at_s) || settings->sag_at_s < 0.0) {
        return usage_error(command, "--sag V and --sag-at S belong together, and S is not negative");
    }
    twin->load_at_s = settings->load_at_s;
    twin->sag_v = settings->sag_v;
    twin->sag_at_s = settings->sag_at_s;
    twin->sags = !isnan(settings->sag_at_s);
    return OPTIONS_RUN;
}

/* What the amplifier can say of its loop: register sample_rate, mHz in 32 bits. */
#define LOWEST_HZ  0.001
#define HIGHEST_HZ (UINT32_MAX * LOWEST_HZ)

int twin_rate_check(const command_t *command, const twin_settings_t *settings, const char *image) {
    const double rate_hz = settings->twin.sample_rate_hz;
    return image != NULL || rate_hz == FIRMWARE_RATE_HZ
               ? OPTIONS_RUN
               : usage_error(command,
                             "--sample-rate %g: the loop of the firmware that comes with this program has %g Hz; "
                             "--image ELF takes one of another rate",
                             rate_hz, FIRMWARE_RATE_HZ);
}

int twin_options_check(const command_t *command, twin_settings_t *settings) {
    twin_options_t *twin = &settings->twin;
    if (settings->resonance != NULL && !read_mode(settings->resonance, &twin->resonance_hz, &twin->resonance_damping)) {
        return usage_error(command, "--resonance %s: not HZ:ZETA, such as 2000:0.02", settings->resonance);
    }
    if (strcmp(settings->speed, "realtime") != 0 && strcmp(settings->speed, "fast") != 0) {
        return usage_error(command, "--speed %s: not realtime or fast", settings->speed);
    }
    if (!(twin->sample_rate_hz >= LOWEST_HZ && twin->sample_rate_hz <= HIGHEST_HZ)) {
        return usage_error(command, "--sample-rate %g: outside %g..%g Hz", twin->sample_rate_hz, LOWEST_HZ, HIGHEST_HZ);
    }
    if (twin->substeps < 1 || twin->substeps > 1000) {
        return usage_error(command, "--substeps %lu: outside 1..1000", twin->substeps);
    }
    if (twin->noise_um < 0.0) {
        return usage_error(command, "--noise-um %g: must not be negative", twin->noise_um);
    }
    twin->real_time = strcmp(settings->speed, "realtime") == 0;
    return check_events(command, settings);
}

void twin_print_run(const twin_run_t *run, const twin_settings_t *settings) {
    const double rate_hz = run->seconds > 0.0 ? (double)run->samples / run->seconds : 0.0;
    (void)fprintf(stderr, "twin: %lu samples in %.2f s, %.0f samples/s, %.2f times real time\n", run->samples,
                  run->seconds, rate_hz, rate_hz / settings->twin.sample_rate_hz);
}
