/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * record --probe against the application itself: recordings that are longer than its capture buffer, and what
 * `hyst diagnose` makes of one.
 */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "amplifier/experiment.h"
#include "compile/compile.h"
#include "diagnosis/diagnose.h"
#include "simulated_device.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static device_t *device;
static hyst_parameters_t image;
static failure_t failure;

/* Of the last run. */
static recording_t r;
static experiment_events_t events;

static void must(bool done) {
    TEST_ASSERT_TRUE_MESSAGE(done, failure.text);
}

/* What a full request takes at 115200 baud, 22.5 ms, and behind a USB adapter that keeps the answer for 16 ms. */
enum { SAMPLES_PER_REQUEST = 400 };

/* -50..50 V, where 0 V is the rest of the twin, and -50..50 um; the drive stays within -45..40 V. */
static void start(twin_t *actuator, uint32_t lookahead_samples) {
    device_options_t options = DEVICE_OPTIONS_DEFAULT;
    options.port = simulated_device_start(actuator);
    options.timeout_s = 0.1;
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    hyst_parameters_default(&image);
    image.drive_half_range_uv = 50000000;
    image.position_half_range_pm = 50000000;
    image.drive_low = drive_from_volts(&image, -45.0);
    image.drive_high = drive_from_volts(&image, 40.0);
    image.transition_slew = 1 << 24;
    image.lookahead_samples = lookahead_samples;
    must(amplifier_image_write(device, &image, &failure));
    simulated_device_line()->samples_per_request = SAMPLES_PER_REQUEST;
}

void setUp(void) {
    failure.text[0] = '\0';
}

void tearDown(void) {
    recording_free(&r);
    device_close(device);
    simulated_device_stop();
}

static experiment_probe_t probe_of(const char *name) {
    const unsigned parts = probe_parts(name, &failure);
    TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(0, parts, failure.text);
    return (experiment_probe_t){.parts = parts, .slew_v_per_s = 50.0 * 85.0, .condition = true, .rest = 0.01};
}

/* Level of sample n = 1, 2 .. of the corners. */
static double level_at(const probe_plan_t *plan, double sample) {
    double from = plan->start_v;
    for (size_t i = 0; i < plan->corners; i++) {
        if (sample <= plan->corner[i].samples) {
            return from + (plan->corner[i].level - from) * sample / plan->corner[i].samples;
        }
        sample -= plan->corner[i].samples;
        from = plan->corner[i].level;
    }
    return from;
}

/*
 * Every frame has the drive of its time, from the first to the last: a lost, doubled or overwritten frame would shift
 * or damage what follows. The actuator is one to one, so displacement = drive.
 */
static void expect_no_gap(const char *name, uint32_t lookahead_samples, unsigned lost_answers) {
    static probe_plan_t plan;
    start(NULL, lookahead_samples);
    simulated_device_fault(LINE_LOSES_ANSWER, 120, lost_answers); /* the 120th request is one of those while it plays */
    const experiment_probe_t probe = probe_of(name);
    must(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
    const unsigned long decimation = (unsigned long)(10000.0 / r.sample_rate_hz + 0.5);
    const probe_limits_t limits = {
        .range_v = {drive_to_volts(&image, image.drive_low), drive_to_volts(&image, image.drive_high)},
        .slew_v_per_s = probe.slew_v_per_s,
        .sample_rate_hz = 10000.0,
        .decimation = decimation,
        .lead = lookahead_samples};
    probe_plan_make(&plan, probe.parts, &limits);
    printf("%zu frames at %g Hz\n", r.samples, r.sample_rate_hz);
    TEST_ASSERT_GREATER_THAN_UINT((unsigned)device_identity(device, INDEX_capture_capacity), r.samples);
    TEST_ASSERT_TRUE(plan.samples == (double)((r.samples - 1) * decimation + lookahead_samples + 1));
    for (size_t i = 0; i < r.samples; i++) {
        const double sample = (double)(i * decimation + lookahead_samples + 1);
        /* Half a code is 100 V / 131072 = 0.76 mV. */
        TEST_ASSERT_DOUBLE_WITHIN(0.00077, level_at(&plan, sample), r.column[COLUMN_DRIVE][i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, r.column[COLUMN_DRIVE][i], r.column[COLUMN_DISPLACEMENT][i]);
    }
    TEST_ASSERT_EQUAL_INT64(0, events.drive_limited + events.overruns + events.unreachable);
}

static void test_a_probe_is_one_recording_without_a_gap(void) {
    expect_no_gap("all", 0, 0);
    TEST_ASSERT_GREATER_THAN_UINT(2 * (unsigned)device_identity(device, INDEX_capture_capacity), r.samples);
    TEST_ASSERT_EQUAL_STRING("sweep, slow triangle, silence, staircase, fast triangle, chirps, burst, ladder, loops, "
                             "return",
                             recording_key(&r, "waveform"));
    TEST_ASSERT_EQUAL_STRING("yes", recording_key(&r, "conditioned"));
}

/* The drive is ahead of the reference then; corners lie on frames all the same. */
static void test_nor_with_lookahead(void) {
    expect_no_gap("amplifier_slew_limit", 7, 0);
}

/* An answer gets lost on the way: what was not read in time is read later. */
static void test_a_disturbed_line_leaves_no_gap(void) {
    expect_no_gap("amplifier_slew_limit", 0, 1);
    TEST_ASSERT_GREATER_THAN_UINT(0, device_repetitions(device));
}

enum { SLOW = 5000 }; /* each answer takes 0.5 s */

/* That is measured first: fewer frames, and no gap. */
static void test_a_slow_line_gets_fewer_frames(void) {
    start(NULL, 0);
    const experiment_probe_t probe = probe_of("all");
    must(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
    const size_t usual = r.samples;
    recording_free(&r);
    simulated_device_line()->samples_per_request = SLOW;
    must(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
    printf("%zu frames, and %zu\n", usual, r.samples);
    TEST_ASSERT_LESS_THAN_UINT(usual, 2 * r.samples);
    /* Those of the buffer are there in any case: at most one half is lost to a whole number of samples a frame. */
    TEST_ASSERT_GREATER_THAN_UINT((unsigned)device_identity(device, INDEX_capture_capacity) / 2, r.samples);
}

/* What somebody else had recorded, and has not ended, cannot be read now. */
static void test_a_capture_that_still_runs_is_no_obstacle(void) {
    start(NULL, 0);
    must(device_unlock(device, CONTROL_PARAMETERS, &failure));
    must(device_write(device, INDEX_capture_decimation, 1000, &failure));
    must(device_command(device, COMMAND_ARM_CAPTURE, &failure));
    const experiment_probe_t probe = probe_of("resonance");
    must(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
}

/* A turn before each request. */
static bool slows_when_it_plays(void *context, failure_t *nothing) {
    (void)context, (void)nothing;
    if (simulated_device_line()->starts > 0) {
        simulated_device_line()->samples_per_request = SLOW;
    }
    return true;
}

/* Better no recording than one with a hole. */
static void test_a_line_that_becomes_too_slow_is_a_failure(void) {
    start(NULL, 0);
    device_take_turns(device, slows_when_it_plays, NULL);
    const experiment_probe_t probe = probe_of("all");
    TEST_ASSERT_FALSE(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "was overwritten before it was read"), failure.text);
}

/* A steep probe is slower where it may not be as steep, and longer. */
static void test_the_slew_rate_is_kept(void) {
    start(NULL, 0);
    experiment_probe_t probe = probe_of("resonance");
    probe.slew_v_per_s = 400.0;
    must(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
    for (size_t i = 1; i < r.samples; i++) {
        /* and one code, 100 V / 65536, of rounding */
        TEST_ASSERT_TRUE(fabs(r.column[COLUMN_DRIVE][i] - r.column[COLUMN_DRIVE][i - 1]) <=
                         400.0 / r.sample_rate_hz + 0.0016);
    }
}

/* An actuator that creeps, a model without creep, and the recording that was made for the question. */
static void test_what_was_recorded_for_creep_names_creep(void) {
    const twin_options_t options = {.sample_rate_hz = 10000.0,
                                    .substeps = 1,
                                    .drive_range_v = {-50.0, 50.0},
                                    .position_range_um = {-50.0, 50.0},
                                    .noise_um = 0.02,
                                    .seed = 5};
    static const double weights[] = {0.6, 0.1, 0.08, 0.07, 0.06, 0.05}, thresholds_v[] = {2.0, 5.0, 10.0, 18.0, 30.0};
    model_t truth, baseline;
    make_bank_model(&truth, 10000.0, 1.0, 5, weights, thresholds_v);
    model_set(model_append(&truth, catalogue_find("creep")), "gamma_per_decade", 0.012);
    twin_t *twin = twin_open(&truth, &options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(twin, failure.text);
    start(twin, 0);
    experiment_probe_t probe = probe_of("creep");
    probe.rest = 1.0; /* as `hyst record` */
    must(experiment_run_probe(device, &image, &probe, &r, &events, &failure));
    make_bank_model(&baseline, r.sample_rate_hz, 1.0, 5, weights, thresholds_v);
    answer_t diagnosis;
    must(diagnose(&baseline, &r, 1, &diagnosis, &failure));
    TEST_ASSERT_GREATER_THAN_UINT(0, diagnosis.findings);
    const model_block_t *creep = model_find(&diagnosis.model, "creep");
    TEST_ASSERT_NOT_NULL_MESSAGE(creep, diagnosis.finding[0].block->name);
    const double gamma = model_parameter(creep, "gamma_per_decade")->value[0];
    printf("%zu samples at %g Hz: creep %g per decade\n", r.samples, r.sample_rate_hz, gamma);
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.012, gamma);
    TEST_ASSERT_EQUAL_STRING("creep", diagnosis.finding[0].block->name);
    TEST_ASSERT_EQUAL_INT(NAMED, diagnosis.finding[0].certainty);
    TEST_ASSERT_EQUAL_UINT(1, diagnosis.findings);
    answer_free(&diagnosis);
    model_free(&baseline);
    model_free(&truth);
    twin_close(twin);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_probe_is_one_recording_without_a_gap);
    RUN_TEST(test_nor_with_lookahead);
    RUN_TEST(test_a_disturbed_line_leaves_no_gap);
    RUN_TEST(test_a_slow_line_gets_fewer_frames);
    RUN_TEST(test_a_capture_that_still_runs_is_no_obstacle);
    RUN_TEST(test_a_line_that_becomes_too_slow_is_a_failure);
    RUN_TEST(test_the_slew_rate_is_kept);
    if (!INSTRUMENTED) { /* the plan is made in test_probe_plan, and test_diagnose diagnoses */
        RUN_TEST(test_what_was_recorded_for_creep_names_creep);
    }
    return UNITY_END();
}
