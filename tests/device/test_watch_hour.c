/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * An hour of the amplifier's time in which nothing happens, and then the load changes: the watch over the model
 * (host_tools/amplifier/model_guard.h, what `hyst watch` polls with) on the application itself. Samples are made by
 * requests and not by the clock, so an hour takes seconds and nothing depends on how busy this machine is.
 *
 * The actuator has noise, and its rest drifts with the temperature of the room, by two thirds of the noise's root mean
 * square. Both together are 1.1 times the noise, and the limit is at twice what was usual.
 */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/opening.h"
#include "amplifier/model_guard.h"
#include "chain/catalogue.h"
#include "compile/compile.h"
#include "loop/telemetry.h"
#include "motion/source.h"
#include "report/event_page.h"
#include "simulated_device.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    HOUR_S = 3600,
    LOAD_S = HOUR_S + 60, /* of the twin's own time; the watch begins after a few seconds of it */
    AFTER_LOAD_S = 300,   /* in which no second warning comes */
    WAVEFORM_S = 90,      /* then another one */
    SAMPLES_A_BLOCK =
        1024, /* a request while it is measured what is usual, as a poll every tenth of a second sees it */
    SAMPLES_A_LOOK = 5000,
    DRIFT_CODES = 30, /* of 1.5 nm */
    DRIFT_S = 1200
};
#define NOISE_UM 0.07 /* of the recording that the demo is made from */
#define RATE_HZ  10000.0

static device_t *device;
static hyst_parameters_t image;
static guard_t guard;
static model_t model;
static twin_t *twin;
static failure_t failure;

static void must(bool done) {
    TEST_ASSERT_TRUE_MESSAGE(done, failure.text);
}

static void set(int index, double value) {
    must(device_write(device, index, (int64_t)lround(value), &failure));
}

static void set_q31(int index, double part) {
    set(index, part * 0x1p31);
}

/* Straight, 1 um/V: what the default image says. */
void setUp(void) {
    const twin_options_t options = {.sample_rate_hz = RATE_HZ,
                                    .substeps = 1,
                                    .drive_range_v = {-50.0, 50.0},
                                    .position_range_um = {-50.0, 50.0},
                                    .noise_um = NOISE_UM,
                                    .load_hz = 250.0,
                                    .load_damping = 0.02,
                                    .load_at_s = LOAD_S,
                                    .seed = 1};
    const double weight = 1.0;
    failure.text[0] = '\0';
    model_create(&model, RATE_HZ);
    model_block_t *block = model_append(&model, catalogue_find("prandtl_ishlinskii"));
    model_set(block, "offset_um", 0.0);
    model_set_array(block, "weights", 1, &weight, NULL);
    twin = twin_open(&model, &options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(twin, failure.text);
    device_options_t line = DEVICE_OPTIONS_DEFAULT;
    line.port = simulated_device_start(twin);
    line.timeout_s = 20.0; /* a request makes many samples, on a machine that may be busy */
    device = device_open(&line, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    hyst_parameters_default(&image);
    image.drive_half_range_uv = 50000000;
    image.position_half_range_pm = 50000000;
    simulated_device_line()->samples_per_request = SAMPLES_A_BLOCK;
    must(amplifier_image_write(device, &image, &failure));
    must(device_arm(device, &failure));
    must(device_unlock(device, CONTROL_OUTPUT, &failure));
}

void tearDown(void) {
    device_close(device);
    simulated_device_stop();
    twin_close(twin);
    model_free(&model);
}

/* What an amplifier does all day. Each replaces the one before, as a master would do it. */
static void play(unsigned which) {
    static const struct {
        int kind;
        double hz, amplitude;
    } waveforms[] = {{SOURCE_BREAKPOINTS, 0.0, 0.0}, {SOURCE_SINE, 10.0, 0.6},    {SOURCE_SINE, 0.1, 0.9},
                     {SOURCE_HOLD, 0.0, 0.0},        {SOURCE_SWEEP, 1.0, 0.3},    {SOURCE_BREAKPOINTS, 0.0, 0.0},
                     {SOURCE_SINE, 50.0, 0.05},      {SOURCE_MULTISINE, 2.0, 0.4}};
    const unsigned count = sizeof waveforms / sizeof waveforms[0];
    const unsigned w = which % count;
    must(device_command(device, COMMAND_STOP, &failure));
    if (waveforms[w].kind == SOURCE_HOLD) {
        set_q31(INDEX_setpoint, 0.3);
        return;
    }
    set(INDEX_source, waveforms[w].kind);
    set_q31(INDEX_source_offset, 0.0);
    set_q31(INDEX_source_amplitude, waveforms[w].amplitude);
    set(INDEX_source_increment, waveforms[w].hz > 0.0 ? waveforms[w].hz * 0x1p32 / RATE_HZ : 1.0);
    must(device_start(device, &failure));
}

/* Lines of 25 ms between levels on both sides of the middle, as in the demo; a sweep to 50 Hz in 5 s; three tones. */
static void tables(void) {
    enum { POINTS = 120 };
    uint16_t points[POINTS * 4];
    uint32_t random = 1;
    for (unsigned i = 0; i < POINTS; i++) {
        random = (uint32_t)((uint64_t)16807U * random % 2147483647U);
        const double level = (i % 2 == 0 ? 0.5 : -0.5) * (0.5 + 0.5 * random / 2147483647.0);
        const uint32_t value = (uint32_t)(int32_t)lround(i + 1 < POINTS ? level * 0x1p31 : 0.0);
        points[4 * i] = 0;
        points[4 * i + 1] = 250;
        points[4 * i + 2] = (uint16_t)(value >> 16);
        points[4 * i + 3] = (uint16_t)value;
    }
    static const uint16_t tones[] = {0, 1, 0x2000, 0, 0, 0, 0, 3, 0x2000, 0, 0x4000, 0, 0, 7, 0x1000, 0, 0x8000, 0};
    must(device_write_block(device, ADDRESS_waveform, 0, POINTS * 4, points, &failure));
    must(device_write_block(device, ADDRESS_tones, 0, sizeof tones / sizeof tones[0], tones, &failure));
    set(INDEX_waveform_points, POINTS);
    set(INDEX_source_tones, 3);
    set(INDEX_sweep_increment, 50.0 * 0x1p32 / RATE_HZ);
    set(INDEX_sweep_samples, 5.0 * RATE_HZ);
    set(INDEX_source_cycles, 0);
    set(INDEX_mode, HYST_MODE_COMPENSATE);
}

static bool no_pause(void *context, failure_t *ignored) {
    (void)context;
    (void)ignored;
    return true;
}

static void drift(void) {
    const double seconds = guard_clock_s(&guard);
    simulated_device_line()->position_offset = (int)lround(DRIFT_CODES * sin(2.0 * acos(-1.0) * seconds / DRIFT_S));
}

/* Looks until the time, or a warning. Another waveform now and then, if there are to be. */
static guard_answer_t watch_until(double until_s, bool change) {
    double changed_s = guard_clock_s(&guard);
    unsigned which = 0;
    guard_answer_t answer = GUARD_QUIET;
    while (answer == GUARD_QUIET && guard_clock_s(&guard) < until_s) {
        drift();
        answer = guard_look(&guard, &failure);
        TEST_ASSERT_NOT_EQUAL_MESSAGE(GUARD_FAILED, answer, failure.text);
        if (change && guard_clock_s(&guard) > changed_s + WAVEFORM_S) {
            changed_s = guard_clock_s(&guard);
            play(++which);
        }
    }
    return answer;
}

static void test_an_hour_without_a_warning_then_one_change_and_one_warning(void) {
    const guard_settings_t settings = GUARD_SETTINGS_DEFAULT;
    recording_t record;
    size_t warned = 0;
    tables();
    play(0);
    must(guard_begin(&guard, device, &image, &settings, no_pause, NULL, &failure));
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * NOISE_UM, NOISE_UM, guard.usual.rms_um);
    const double begun_s = guard.begun / RATE_HZ;
    simulated_device_line()->samples_per_request = SAMPLES_A_LOOK;

    TEST_ASSERT_EQUAL_MESSAGE(GUARD_QUIET, watch_until(HOUR_S, true), "a warning within the hour");
    TEST_ASSERT_EQUAL_INT64_MESSAGE(0, guard.now[INDEX_warnings_sticky] & WARNING_MODEL, "one that came and went");
    const uint32_t blocks = (uint32_t)guard.now[INDEX_model_error_blocks];
    TEST_ASSERT_GREATER_THAN_UINT32_MESSAGE(HOUR_S * 9, blocks, "of 9.8 a second: it was watched all the time");

    play(0);
    TEST_ASSERT_EQUAL_MESSAGE(GUARD_WARNED, watch_until(LOAD_S + 30, false), "the load was not noticed");
    simulated_device_line()->samples_per_request = SAMPLES_A_BLOCK;
    const double warned_s = guard_clock_s(&guard) + begun_s;
    must(guard_fetch(&guard, &record, &warned, &failure));
    printf("watched %.0f s; load at %d s, record whole at %.2f s\n", guard_clock_s(&guard), LOAD_S, warned_s);
    TEST_ASSERT_TRUE(warned_s > LOAD_S && warned_s < LOAD_S + 10);
    const double at_s = (double)warned / record.sample_rate_hz;
    const double since_s = event_since_s(&record, at_s, settings.time_s, guard.usual.rms_um, guard.limit_um);
    TEST_ASSERT_TRUE_MESSAGE(since_s >= 0.0 && since_s < at_s, "it is dated within the record");
    recording_free(&record);

    must(guard_again(&guard, no_pause, NULL, &failure));
    simulated_device_line()->samples_per_request = SAMPLES_A_LOOK;
    TEST_ASSERT_EQUAL_MESSAGE(GUARD_QUIET, watch_until(guard_clock_s(&guard) + AFTER_LOAD_S, false),
                              "a second warning");
    must(guard_end(&guard, &failure));
}

/* One that is given holds, or the watch does not begin: it is not replaced by another. */
static void test_a_limit_that_is_given(void) {
    guard_settings_t settings = GUARD_SETTINGS_DEFAULT;
    static const double never[] = {-1.0, 0.0, (double)INFINITY, -(double)INFINITY};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; i++) {
        settings.limit_um = never[i];
        TEST_ASSERT_FALSE(guard_settings_check(&settings, &failure));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, ": must be above 0"), failure.text);
    }
    tables();
    play(0);
    settings.limit_um = 0.5 * NOISE_UM;
    TEST_ASSERT_TRUE(guard_settings_check(&settings, &failure));
    TEST_ASSERT_FALSE(guard_begin(&guard, device, &image, &settings, no_pause, NULL, &failure));
    char usual[64];
    (void)snprintf(usual, sizeof usual, "--limit 0.035: the error is already %.4g um", guard.usual.rms_um);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, usual), failure.text);
    settings.limit_um = 1.5 * NOISE_UM;
    must(guard_begin(&guard, device, &image, &settings, no_pause, NULL, &failure));
    TEST_ASSERT_TRUE(guard.limit_um == settings.limit_um);
    must(guard_end(&guard, &failure));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_limit_that_is_given);
    RUN_TEST(test_an_hour_without_a_warning_then_one_change_and_one_warning);
    return UNITY_END();
}
