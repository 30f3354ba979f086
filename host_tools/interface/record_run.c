/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/record_run.h"
#include "amplifier/amplifier_image.h"
#include "amplifier/driving.h"
#include "compile/compile.h"
#include <stdio.h>
#include <string.h>

/* The whole drive range in 20 ms: fast enough for electronics to show, gentle for most high-voltage amplifiers. */
static const double ranges_per_s = 50.0;
/* As long as the probe: creep is linear in the logarithm of time. After a fourth of it the conditioning went on in a
 * probe for creep, and every second diagnosis took that for a hysteresis of another shape; after half of it, none. */
static const double probe_rest = 1.0;

static bool given(const double range[2]) {
    return range[0] < range[1];
}

/* Writes centre and half range in millionths of the unit, which is how the image has them. */
static bool set_scale(const double range[2], int32_t *center, int32_t *half_range, const char *what,
                      failure_t *failure) {
    const double millionths[2] = {range[0] * 1e6, range[1] * 1e6};
    if (fabs(millionths[0]) > INT32_MAX || fabs(millionths[1]) > INT32_MAX) {
        return fail(failure, "%s %g:%g: an image holds at most 2147 to each side", what, range[0], range[1]);
    }
    *center = (int32_t)lround((millionths[0] + millionths[1]) / 2.0);
    *half_range = (int32_t)lround((millionths[1] - millionths[0]) / 2.0);
    return true;
}

/* Replaces the scales of the image, for an amplifier whose image does not know the units yet. */
static bool set_scales(hyst_parameters_t *image, const record_options_t *options, failure_t *failure) {
    return (!given(options->drive_range_v) || set_scale(options->drive_range_v, &image->drive_center_uv,
                                                        &image->drive_half_range_uv, "--drive-range", failure)) &&
           (!given(options->position_range_um) ||
            set_scale(options->position_range_um, &image->position_center_pm, &image->position_half_range_pm,
                      "--position-range", failure)) &&
           parameters_check(image, "--drive-range, --position-range", failure);
}

/* Ends that differ by more than this share of the range contradict each other; a rounded print does not. */
static const double same_range = 1e-3;

enum { CONTRADICTION = 200 };

/* Appends to the text what was given and what the image says, where these differ. */
static void compare(const double range[2], double low, double high, const char *option, const char *unit,
                    char text[CONTRADICTION]) {
    const size_t used = strlen(text);
    if (given(range) && fmax(fabs(range[0] - low), fabs(range[1] - high)) > same_range * (high - low)) {
        (void)snprintf(text + used, CONTRADICTION - used, "%s%s %g:%g, where the image in force says %g:%g %s",
                       used > 0 ? "; " : "", option, range[0], range[1], low, high, unit);
    }
}

static void find_contradiction(const hyst_parameters_t *image, const record_options_t *options,
                               char text[CONTRADICTION]) {
    const double um = 1e-6, drive_v = um * image->drive_center_uv, half_v = um * image->drive_half_range_uv,
                 position_um = um * image->position_center_pm, half_um = um * image->position_half_range_pm;
    text[0] = '\0';
    if (!amplifier_image_is_neutral(image)) {
        compare(options->drive_range_v, drive_v - half_v, drive_v + half_v, "--drive-range", "V", text);
        compare(options->position_range_um, position_um - half_um, position_um + half_um, "--position-range", "um",
                text);
    }
}

/* The ranges that were given; an amplifier without parameters gets them as an image, since it cannot be armed without.
 */
static bool give_ranges(device_t *device, hyst_parameters_t *image, const record_options_t *options,
                        failure_t *failure) {
    const bool neutral = amplifier_image_is_neutral(image);
    return set_scales(image, options, failure) && (!neutral || amplifier_image_write(device, image, failure));
}

/* With unknown ranges nothing is played, and no volts are written into a file. */
static bool check_scales(const hyst_parameters_t *image, const record_options_t *options, failure_t *failure) {
    return !amplifier_image_is_neutral(image) || (given(options->drive_range_v) && given(options->position_range_um)) ||
           fail(failure, "the amplifier has no parameters, so what its converters' ranges are is not known: give "
                         "--drive-range LO:HI in V and --position-range LO:HI in um, or `hyst push` an image first");
}

/* Fills in the default. */
static bool choose_slew_rate(const record_options_t *options, const double range_v[2], double *slew_v_per_s,
                             failure_t *failure) {
    const double width_v = range_v[1] - range_v[0];
    *slew_v_per_s = isnan(options->slew_v_per_s) ? ranges_per_s * width_v : options->slew_v_per_s;
    return *slew_v_per_s * PROBE_PLAN_SLOWEST_S >= width_v ||
           fail(failure, "--slew-rate %g: a probe needs at least %g V/s for a range of %g V", options->slew_v_per_s,
                width_v / PROBE_PLAN_SLOWEST_S, width_v);
}

bool record_check(const record_options_t *options, failure_t *failure) {
    failure_t of_probe;
    if (options->probe == NULL) {
        return isnan(options->slew_v_per_s) || fail(failure, "--slew-rate belongs to --probe");
    }
    if (options->waveform.name != NULL) {
        return fail(failure, "either --waveform or --probe");
    }
    if (!isnan(options->waveform.amplitude) || !isnan(options->waveform.offset)) {
        return fail(failure, "--amplitude, --offset: a probe takes the whole drive range of the image");
    }
    return probe_parts(options->probe, &of_probe) != 0 || fail(failure, "--probe %s", of_probe.text);
}

typedef struct {
    hyst_parameters_t image;
    experiment_t experiment;
    experiment_probe_t probe; /* without parts: the experiment */
    const record_listener_t *listener;
    recording_t *recording;
    experiment_events_t events;
    char contradiction[CONTRADICTION]; /* "": none */
} run_t;

static void note_contradiction(const run_t *run) {
    if (run->contradiction[0] != '\0') {
        recording_set_key(run->recording, RECORDING_CONTRADICTION_KEY, run->contradiction);
    }
}

/* A recording that is complete is kept, even if the amplifier could not be disarmed after it. */
static bool play(device_t *device, void *context, failure_t *failure) {
    run_t *run = context;
    const record_listener_t *listener = run->listener;
    const bool played =
        run->probe.parts != 0
            ? experiment_run_probe(device, &run->image, &run->probe, run->recording, &run->events, failure)
            : experiment_run(device, &run->image, &run->experiment, run->recording, &run->events, failure);
    if (run->recording->samples == 0) {
        return false;
    }
    note_contradiction(run);
    const bool taken =
        listener->take == NULL || listener->take(listener->context, run->recording, &run->events, failure);
    if (!(taken && played)) {
        recording_free(run->recording);
    }
    return taken && played;
}

bool record_run(device_t *device, const record_options_t *options, const record_listener_t *listener,
                recording_t *recording, bool *usage, failure_t *failure) {
    run_t run = {
        .experiment = {.mode = HYST_MODE_DIRECT, .condition = !options->no_condition, .frames = options->frames},
        .probe = {.condition = !options->no_condition, .rest = probe_rest},
        .listener = listener,
        .recording = recording};
    hyst_parameters_t *image = &run.image;
    const driving_t driving = {.play = play, .context = &run, .stop = listener->stop};
    *usage = !record_check(options, failure);
    if (*usage || !amplifier_image_read(device, image, failure) || !check_scales(image, options, failure)) {
        return false;
    }
    find_contradiction(image, options, run.contradiction);
    if (!give_ranges(device, image, options, failure)) {
        return false;
    }
    const double range_v[2] = {drive_to_volts(image, image->drive_low), drive_to_volts(image, image->drive_high)};
    run.probe.parts = options->probe != NULL ? probe_parts(options->probe, failure) : 0;
    *usage =
        !(options->probe != NULL ? choose_slew_rate(options, range_v, &run.probe.slew_v_per_s, failure)
                                 : waveform_make(&options->waveform, range_v, "V", &run.experiment.waveform, failure));
    if (*usage) {
        return false;
    }
    if (options->probe == NULL && !experiment_check(device, &run.experiment, failure)) {
        return false;
    }
    *recording = (recording_t){0};
    const bool good = driving_run(device, &driving, failure);
    if (!good) {
        recording_free(recording);
    }
    return good;
}
