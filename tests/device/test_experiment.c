/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Upload and experiments against the application itself, whose actuator follows the drive one to one. */
#include "amplifier/amplifier_image.h"
#include "amplifier/capture_reader.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/opening.h"
#include "amplifier/device/restart.h"
#include "amplifier/driving.h"
#include "amplifier/experiment.h"
#include "chain/fit_ranges.h"
#include "compile/compile.h"
#include "simulated_device.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static device_t *device;
static hyst_parameters_t parameters;
static failure_t failure;

/* Of the last run. */
static recording_t r;
static experiment_events_t events;

/* Full scale: 10..90 V and -30..50 um; the whole range in 10 ms. */
static void make_parameters(void) {
    hyst_parameters_default(&parameters);
    parameters.model_id = 0xC0FFEE;
    parameters.drive_center_uv = 50000000;
    parameters.drive_half_range_uv = 40000000;
    parameters.position_center_pm = 10000000;
    parameters.position_half_range_pm = 40000000;
    parameters.transition_slew = 1 << 24;
}

void setUp(void) {
    device_options_t options = DEVICE_OPTIONS_DEFAULT;
    options.port = simulated_device_start(NULL);
    failure.text[0] = '\0';
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE_MESSAGE(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure), failure.text);
    make_parameters();
}

void tearDown(void) {
    recording_free(&r);
    device_close(device);
    simulated_device_stop();
}

static void expect_line(const char *part) {
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, part), failure.text);
}

static void upload(void) {
    TEST_ASSERT_TRUE_MESSAGE(amplifier_image_write(device, &parameters, &failure), failure.text);
}

static void expect_in_force(uint32_t model_id) {
    hyst_parameters_t active;
    TEST_ASSERT_TRUE_MESSAGE(amplifier_image_read(device, &active, &failure), failure.text);
    TEST_ASSERT_EQUAL_HEX32(model_id, active.model_id);
}

static void test_upload_comes_back(void) {
    hyst_parameters_t active;
    parameters.pi_operators = HYST_PI_MAX_OPERATORS; /* the longest block */
    for (uint32_t i = 0; i < HYST_PI_MAX_OPERATORS; i++) {
        parameters.pi_weight[i + 1] = HYST_Q28_ONE / HYST_PI_MAX_OPERATORS;
        parameters.pi_threshold[i] = (hyst_q31_t)(i + 1) * (HYST_Q31_MAX / (HYST_PI_MAX_OPERATORS + 1));
    }
    upload();
    TEST_ASSERT_TRUE_MESSAGE(amplifier_image_read(device, &active, &failure), failure.text);
    TEST_ASSERT_EQUAL_MEMORY(parameters.pi_weight, active.pi_weight, sizeof active.pi_weight);
    TEST_ASSERT_EQUAL_MEMORY(parameters.pi_threshold, active.pi_threshold, sizeof active.pi_threshold);
    expect_in_force(0xC0FFEE);
}

static void test_upload_over_a_bad_line(void) {
    const line_fault_t faults[] = {LINE_LOSES_REQUEST, LINE_LOSES_ANSWER, LINE_FLIPS_BIT};
    for (unsigned request = 0; request < 6; request++) {
        parameters.model_id = 100 + request;
        simulated_device_fault(faults[request % 3], request, 1);
        upload();
        expect_in_force(100 + request);
    }
}

static void test_refused_image_names_field_element_and_reason(void) {
    upload();
    parameters.model_id = 2;
    parameters.pi_operators = 3;
    for (int i = 0; i < 3; i++) {
        parameters.pi_threshold[i] = (i + 1) << 24;
    }
    parameters.pi_weight[3] = -2 * HYST_Q28_ONE; /* slope behind corner 3 is negative */
    TEST_ASSERT_FALSE(amplifier_image_write(device, &parameters, &failure));
    expect_line("the amplifier refuses the image and keeps the one it has: ");
    expect_line(hyst_field_text(HYST_FIELD_PI_WEIGHT));
    expect_line("[3]");
    expect_line(hyst_parameters_error_text(HYST_PARAMETERS_NOT_INVERTIBLE));
    expect_in_force(0xC0FFEE);
}

static void test_image_for_another_rate_is_explained(void) {
    parameters.sample_rate_mhz = 5000000;
    TEST_ASSERT_FALSE(amplifier_image_write(device, &parameters, &failure));
    expect_line("made for 5000 samples per second, the amplifier runs at 10000: compile it with --sample-rate 10000");
    expect_in_force(0);
}

/* One register of the read-back differs: requests are key, staging (1), commit, result, length, then the image. */
static void test_a_read_back_that_differs_is_noticed(void) {
    simulated_device_fault(LINE_LIES, 5, 1);
    TEST_ASSERT_FALSE(amplifier_image_write(device, &parameters, &failure));
    expect_line("the image in force is not the one that was sent: word ");
}

static experiment_t experiment_of(hyst_mode_t mode, waveform_kind_t kind, double amplitude, double offset) {
    return (experiment_t){
        .mode = mode,
        .condition = true,
        .waveform = {
            .kind = kind, .frequency_hz = 4.0, .amplitude = amplitude, .offset = offset, .cycles = 3, .steps = 5}};
}

/* Turns of a sweep after so many samples: what its frequency adds up to. */
static double turns_of(const waveform_t *w, double samples, double rate_hz) {
    const double whole = w->sweep_s * rate_hz;
    const double start = w->frequency_hz / rate_hz, end = w->end_frequency_hz / rate_hz;
    return w->linear ? start * samples + (end - start) * samples * (samples - 1.0) / 2.0 / whole
                     : start * (pow(end / start, samples / whole) - 1.0) / (pow(end / start, 1.0 / whole) - 1.0);
}

static double level_of_tones(const waveform_t *w, double turns) {
    double sum = 0.0;
    for (size_t i = 0; i < w->tones; i++) {
        sum += w->tone[i].amplitude * sin(2.0 * acos(-1.0) * (w->tone[i].harmonic * turns + w->tone[i].phase_turns));
    }
    return w->offset + w->amplitude * sum;
}

/* Level of row `row`, by definition: the sine starts at phase 0, a polygon with the first sample on its way. */
static double level_at(const waveform_t *w, size_t row) {
    const double pi = acos(-1.0);
    const double rate_hz = 10000.0;
    if (w->kind == WAVEFORM_SINE) {
        return w->offset + w->amplitude * sin(2.0 * pi * w->frequency_hz * (double)row / rate_hz);
    }
    if (w->kind == WAVEFORM_SWEEP) {
        return w->offset + w->amplitude * sin(2.0 * pi * turns_of(w, (double)row, rate_hz));
    }
    if (w->kind == WAVEFORM_MULTISINE) {
        return level_of_tones(w, w->frequency_hz * (double)row / rate_hz);
    }
    breakpoint_t corner[WAVEFORM_MAX_BREAKPOINTS];
    const size_t corners = waveform_breakpoints(w, rate_hz, corner);
    double left = (double)row + 1.0;
    double level = waveform_start(w);
    for (size_t i = 0;; i = (i + 1) % corners) {
        if (left <= (double)corner[i].samples) {
            return level + (corner[i].level - level) * left / (double)corner[i].samples;
        }
        left -= (double)corner[i].samples;
        level = corner[i].level;
    }
}

/*
 * In direct mode the position is the drive of the same instant, so with the scales above displacement = drive - 40, to
 * the last bit: an error of one sample in the alignment of the two would show at every corner.
 */
static void test_record_pairs_drive_and_position(void) {
    upload();
    for (waveform_kind_t kind = WAVEFORM_SINE; kind <= WAVEFORM_STAIRCASE; kind++) {
        const experiment_t experiment = experiment_of(HYST_MODE_DIRECT, kind, 30.0, 45.0);
        TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT(7500, r.samples);
        TEST_ASSERT_TRUE(r.sample_rate_hz == 10000.0);
        TEST_ASSERT_NULL(r.column[COLUMN_REFERENCE]);
        TEST_ASSERT_EQUAL_STRING("004400553332470F20313937", recording_key(&r, "amplifier_serial"));
        TEST_ASSERT_NOT_NULL(
            strstr(recording_key(&r, "device"), ", serial number 004400553332470F20313937, firmware "));
        for (size_t i = 0; i < r.samples; i++) {
            const double drive = r.column[COLUMN_DRIVE][i];
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, drive - 40.0, r.column[COLUMN_DISPLACEMENT][i]);
            /* Half a code is 40 V / 65536 = 0.61 mV. The sine's frequency is a multiple of 10 kHz / 2^32, wrong by at
             * most half of that, which in 0.75 s is 30 V * 2 pi * 0.75 * 1.2e-6 = 0.17 mV. */
            TEST_ASSERT_DOUBLE_WITHIN(0.0008, level_at(&experiment.waveform, i), drive);
        }
        TEST_ASSERT_EQUAL_INT64(0, events.drive_limited + events.overruns + events.unreachable);
        recording_free(&r);
    }
}

/* As above. A frequency is wrong by 1.2e-6 Hz at most, that of a tone by 25 times that at most: 30 V * 2 pi * 0.75 *
 * 29e-6 = 4 mV if all tones were the highest. */
static void record_and_compare(const waveform_options_t *options) {
    const double range[2] = {0.0, 80.0};
    experiment_t experiment = {.mode = HYST_MODE_DIRECT, .condition = true};
    TEST_ASSERT_TRUE_MESSAGE(waveform_make(options, range, "V", &experiment.waveform, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(7500, r.samples);
    for (size_t i = 0; i < r.samples; i++) {
        const double drive = r.column[COLUMN_DRIVE][i];
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, drive - 40.0, r.column[COLUMN_DISPLACEMENT][i]);
        TEST_ASSERT_DOUBLE_WITHIN(0.005, level_at(&experiment.waveform, i), drive);
    }
    recording_free(&r);
}

static void test_sweeps_and_multisines_are_what_was_asked_for(void) {
    waveform_options_t options = WAVEFORM_OPTIONS_DEFAULT;
    upload();
    options.offset = 45.0;
    options.amplitude = 30.0;
    options.name = "sweep";
    options.frequency_hz = 2.0;
    options.end_frequency_hz = 100.0;
    options.sweep_s = 0.75;
    options.cycles = 1;
    record_and_compare(&options);
    options.linear = true;
    record_and_compare(&options);
    options.frequency_hz = 100.0;
    options.end_frequency_hz = 2.0;
    record_and_compare(&options);
    options.linear = false;
    record_and_compare(&options);
    options.name = "multisine";
    options.frequency_hz = 4.0;
    options.end_frequency_hz = 100.0;
    options.cycles = 3;
    record_and_compare(&options);
}

/* With gain 1 and no delay left the reference is the position, within the rounding of both to 16 bits. */
static void test_track_pairs_reference_and_position(void) {
    parameters.lookahead_samples = 0;
    upload();
    const experiment_t experiment = experiment_of(HYST_MODE_COMPENSATE, WAVEFORM_TRIANGLE, 30.0, 5.0);
    TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
    for (size_t i = 0; i < r.samples; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.01 * 80.0 / 65536.0, r.column[COLUMN_REFERENCE][i],
                                  r.column[COLUMN_DISPLACEMENT][i]);
    }
    TEST_ASSERT_EQUAL_STRING("compensate", recording_key(&r, "mode"));
}

static void test_long_waveforms_are_thinned_to_fit(void) {
    upload();
    experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_TRIANGLE, 30.0, 45.0);
    experiment.waveform.frequency_hz = 1.0; /* 30000 samples into 10666 frames: every third */
    TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(10000, r.samples);
    TEST_ASSERT_TRUE(r.sample_rate_hz == 10000.0 / 3.0);
    /* Frame 832 is sample 2497 of the 2500 to the first top. */
    TEST_ASSERT_DOUBLE_WITHIN(0.0013, 45.0 + 30.0 * 2497.0 / 2500.0, r.column[COLUMN_DRIVE][832]);
    TEST_ASSERT_EQUAL_STRING("10.000000:90.000000", recording_key(&r, DRIVE_CONVERTER_KEY));
    TEST_ASSERT_EQUAL_STRING("-30.000000:50.000000", recording_key(&r, POSITION_CONVERTER_KEY));
    recording_free(&r);
    experiment.frames = 999; /* 30000 samples: every 31st */
    TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(967, r.samples);
    recording_free(&r);
    experiment.frames = 1;
    TEST_ASSERT_FALSE(experiment_run(device, &parameters, &experiment, &r, &events, &failure));
    expect_line("fewer than two samples");
}

static void test_events_are_counted(void) {
    parameters.drive_high = HYST_Q31_MAX / 4; /* 60 V */
    upload();
    const experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_TRIANGLE, 30.0, 45.0);
    TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
    TEST_ASSERT_GREATER_THAN_INT64(100, events.drive_limited);
}

static void test_a_loop_that_stands_still_is_noticed(void) {
    upload();
    simulated_device_line()->loop_stands = true;
    const experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 30.0, 45.0);
    TEST_ASSERT_FALSE(experiment_run(device, &parameters, &experiment, &r, &events, &failure));
    expect_line("the amplifier's loop stands still at sample ");
}

static void test_an_amplifier_that_somebody_parks_ends_the_run(void) {
    upload();
    const experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 30.0, 45.0);
    simulated_device_line()->park_after = 19; /* while it conditions */
    TEST_ASSERT_FALSE(experiment_run(device, &parameters, &experiment, &r, &events, &failure));
    expect_line("the amplifier has parked (faults: none)");
}

/* At each request of a run that is halted so: what the amplifier refuses then, it refuses because it has parked, or for
 * the other reason. Nothing is the matter before it is armed, where it is parked already, and after the last sample. */
static void expect_it_called_so(volatile unsigned *halt_after, const char *otherwise) {
    experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 30.0, 45.0);
    experiment.condition = false;
    unsigned halted = 0;
    for (unsigned after = 10; after <= 45; after++) {
        upload();
        *halt_after = after;
        const bool good = experiment_run(device, &parameters, &experiment, &r, &events, &failure);
        if (!good) {
            TEST_ASSERT_TRUE_MESSAGE(strstr(failure.text, "the amplifier has parked (faults: none)") != NULL ||
                                         strstr(failure.text, otherwise) != NULL,
                                     failure.text);
            halted++;
        }
        recording_free(&r);
        *halt_after = 0;
        TEST_ASSERT_TRUE_MESSAGE(device_command(device, COMMAND_DISARM, &failure), failure.text);
    }
    TEST_ASSERT_GREATER_THAN_UINT(10, halted);
}

/* A parking between the setpoint and the mode takes the way to the start away. */
static void test_a_parking_at_any_time_is_called_so(void) {
    expect_it_called_so(&simulated_device_line()->park_after,
                        "the waveform begins at 45 V, and the amplifier's reference rests at 50: does somebody else "
                        "move or park it?");
}

/* The same where it is switched off: nothing can be set in motion then, in no mode. */
static void test_a_disarming_at_any_time_is_called_so(void) {
    expect_it_called_so(&simulated_device_line()->disarm_after, "somebody else has switched the amplifier off");
}

static int code_of(double volts) {
    return (int)lround((volts - 10.0) / 80.0 * 65536.0);
}

static bool play_a_minute(device_t *d, void *context, failure_t *f) {
    (void)context;
    experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 10.0, 50.0);
    experiment.waveform.cycles = 240;
    return experiment_run(d, &parameters, &experiment, &r, &events, f);
}

static bool is_one_of_the_first(void *context, failure_t *f) {
    int *const left = context;
    return --*left >= 0 || fail(f, "stopped");
}

/* Whatever request it is that is kept back: one whose failure does not matter must not take the end with it. */
static void test_a_turn_that_fails_ends_the_run_at_any_request(void) {
    const driving_t driving = {.play = play_a_minute};
    upload();
    for (int request = 0; request < 30; request++) {
        int left = request;
        const unsigned before = simulated_device_line()->requests;
        device_take_turns(device, is_one_of_the_first, &left);
        TEST_ASSERT_FALSE(driving_run(device, &driving, &failure));
        device_take_turns(device, NULL, NULL);
        expect_line("stopped");
        /* And to park, the communication timeout, whether it restarted (2), the lock. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT(request + 5, simulated_device_line()->requests - before);
        int64_t now[REGISTER_COUNT];
        TEST_ASSERT_TRUE(driving_halt(device, COMMAND_DISARM, now, &failure));
    }
}

static bool cut_the_line(device_t *d, void *context, failure_t *f) {
    (void)d, (void)context, (void)f;
    simulated_device_fault(LINE_LOSES_REQUEST, 0, 100);
    return true;
}

/* The line is cut when what plays is to be left to its own timeout: the amplifier may have that already. */
static void test_a_line_that_is_cut_behind_a_start_names_the_longer_timeout(void) {
    const driving_t play = {.play = cut_the_line, .silence_s = 30.0}, brief = {.play = cut_the_line, .silence_s = 0.2};
    upload();
    TEST_ASSERT_FALSE(driving_run(device, &play, &failure));
    expect_line("did not take the command to park: without requests it parks by itself after 30 s");
    simulated_device_fault(LINE_GOOD, 0, 0);
    TEST_ASSERT_FALSE(driving_run(device, &brief, &failure));
    char expected[100];
    (void)snprintf(expected, sizeof expected, "it parks by itself after %g s",
                   (double)device_communication_timeout_ms(device) / 1000.0);
    expect_line(expected);
    simulated_device_fault(LINE_GOOD, 0, 0);
}

/* Whatever the hold source held before: it counts as a position in one mode and as a drive in the other. */
static void test_the_drive_stays_between_park_and_what_was_asked_for(void) {
    static const hyst_mode_t modes[] = {HYST_MODE_DIRECT, HYST_MODE_COMPENSATE};
    line_control_t *line = simulated_device_line();
    parameters.drive_park = (hyst_q31_t)(-0.9 * 0x1p31); /* 14 V, where the position is -26 um */
    upload();
    for (size_t i = 0; i < 2; i++) {
        experiment_t experiment =
            experiment_of(modes[i], WAVEFORM_SINE, 2.0, modes[i] == HYST_MODE_DIRECT ? 18.0 : -22.0);
        experiment.condition = false;
        TEST_ASSERT_TRUE_MESSAGE(device_arm(device, &failure), failure.text);
        TEST_ASSERT_TRUE(device_write(device, INDEX_mode, HYST_MODE_LINEAR, &failure) &&
                         device_write(device, INDEX_setpoint, HYST_Q31_MAX / 2, &failure));
        int64_t reference = 0;
        while (reference != HYST_Q31_MAX / 2) {
            TEST_ASSERT_TRUE_MESSAGE(device_read(device, INDEX_reference, &reference, &failure), failure.text);
        }
        TEST_ASSERT_TRUE_MESSAGE(device_command(device, COMMAND_DISARM, &failure) &&
                                     device_expect_off(device, "it", &failure),
                                 failure.text);
        line->lowest = 65535;
        line->highest = 0;
        TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
        TEST_ASSERT_INT_WITHIN(20, code_of(14.0), line->lowest);
        TEST_ASSERT_INT_WITHIN(20, code_of(20.0), line->highest);
        recording_free(&r);
    }
}

/* The reference would never get there, and the run never begin. */
static void test_a_start_outside_the_references_limits_is_refused(void) {
    upload();
    const experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 2.0, 60.0);
    TEST_ASSERT_TRUE_MESSAGE(device_write(device, INDEX_reference_high, 0, &failure), failure.text); /* 50 V */
    TEST_ASSERT_FALSE(experiment_run(device, &parameters, &experiment, &r, &events, &failure));
    expect_line("the amplifier keeps its reference between 10 and 50 (registers reference_low, reference_high)");
    TEST_ASSERT_EQUAL_UINT(0, simulated_device_line()->starts);
}

/* The sample's number wraps while it goes to the start, and while it plays. */
static void test_a_run_goes_on_when_the_sample_number_wraps(void) {
    upload();
    experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 30.0, 45.0);
    experiment.condition = false;
    for (uint32_t left = 20000; left <= 60000; left += 10000) { /* a run is some 50000 samples here */
        simulated_device_line()->sequence = (uint32_t)(0 - left);
        int64_t now;
        TEST_ASSERT_TRUE_MESSAGE(device_read(device, INDEX_sequence, &now, &failure), failure.text);
        device_note_start(device);
        TEST_ASSERT_TRUE_MESSAGE(experiment_run(device, &parameters, &experiment, &r, &events, &failure), failure.text);
        TEST_ASSERT_EQUAL_UINT(7500, r.samples);
        recording_free(&r);
    }
}

/* The line answers on, and the capture reads as 0 from there. */
static void test_a_restart_while_the_capture_is_read_is_no_recording(void) {
    line_control_t *line = simulated_device_line();
    experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 30.0, 45.0);
    for (int supply = 0; supply < 2; supply++) {
        upload();
        device_note_start(device);
        line->supply_goes = supply != 0;
        line->restart_at_capture = true;
        line->restart_after = 80; /* of some 180 */
        TEST_ASSERT_FALSE(experiment_run(device, &parameters, &experiment, &r, &events, &failure));
        TEST_ASSERT_EQUAL_UINT(0, line->restart_after);
        TEST_ASSERT_EQUAL_STRING("the amplifier restarted: what was set in it and not stored is gone", failure.text);
        TEST_ASSERT_EQUAL_UINT(0, r.samples);
    }
}

/* At each request of a run, the failure is the restart, and not what the amplifier refuses after it. */
static void test_a_restart_at_any_time_is_called_so(void) {
    line_control_t *line = simulated_device_line();
    experiment_t experiment = experiment_of(HYST_MODE_DIRECT, WAVEFORM_SINE, 30.0, 45.0);
    experiment.condition = false;
    for (unsigned after = 1; after <= 40; after += 3) {
        upload();
        device_note_start(device);
        line->restart_after = after;
        TEST_ASSERT_FALSE(experiment_run(device, &parameters, &experiment, &r, &events, &failure));
        expect_line("the amplifier restarted: what was set in it and not stored is gone");
    }
}

/* What an amplifier says of itself is no reason to write behind the frames that there is room for. */
static void test_more_frames_than_there_are_to_be_are_refused(void) {
    capture_reader_t reader = capture_reader(device, 10);
    reader.done = 10;
    TEST_ASSERT_FALSE(capture_reader_some(&reader, 11, &failure));
    expect_line("the amplifier says that it has captured 11 frames of 10");
    TEST_ASSERT_FALSE(capture_reader_some(&reader, 9, &failure));
    TEST_ASSERT_TRUE_MESSAGE(capture_reader_some(&reader, 10, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT(10, reader.done);
    capture_reader_free(&reader);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_upload_comes_back);
    RUN_TEST(test_upload_over_a_bad_line);
    RUN_TEST(test_refused_image_names_field_element_and_reason);
    RUN_TEST(test_image_for_another_rate_is_explained);
    RUN_TEST(test_a_read_back_that_differs_is_noticed);
    RUN_TEST(test_record_pairs_drive_and_position);
    RUN_TEST(test_sweeps_and_multisines_are_what_was_asked_for);
    RUN_TEST(test_track_pairs_reference_and_position);
    RUN_TEST(test_long_waveforms_are_thinned_to_fit);
    RUN_TEST(test_events_are_counted);
    RUN_TEST(test_a_loop_that_stands_still_is_noticed);
    RUN_TEST(test_an_amplifier_that_somebody_parks_ends_the_run);
    RUN_TEST(test_a_parking_at_any_time_is_called_so);
    RUN_TEST(test_a_disarming_at_any_time_is_called_so);
    RUN_TEST(test_a_turn_that_fails_ends_the_run_at_any_request);
    RUN_TEST(test_a_line_that_is_cut_behind_a_start_names_the_longer_timeout);
    RUN_TEST(test_the_drive_stays_between_park_and_what_was_asked_for);
    RUN_TEST(test_a_start_outside_the_references_limits_is_refused);
    RUN_TEST(test_a_run_goes_on_when_the_sample_number_wraps);
    RUN_TEST(test_a_restart_while_the_capture_is_read_is_no_recording);
    RUN_TEST(test_a_restart_at_any_time_is_called_so);
    RUN_TEST(test_more_frames_than_there_are_to_be_are_refused);
    return UNITY_END();
}
