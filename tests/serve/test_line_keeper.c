/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The owner of the line: a stop overtakes work, a line that is cut comes back. Against the simulated amplifier. */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/opening.h"
#include "amplifier/driving.h"
#include "amplifier/experiment.h"
#include "base/monotonic_clock.h"
#include "loop/telemetry.h"
#include "serve/line_keeper.h"
#include "simulated_device.h"
#include "unity.h"
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* For what surely comes. */
#define PATIENCE_S 60.0
/* For an answer: three hundred times what it takes when nothing is wrong. */
#define TIMEOUT_S 0.3
/* The port as the keeper knows it: a link, as those in /dev/serial/by-id are, to what is plugged in. */
#define PORT "line-keeper-port"

static device_options_t options = DEVICE_OPTIONS_DEFAULT;
static line_keeper_t *keeper;
static atomic_bool stop_at_snapshot;

/* What the keeper has said; written in its thread. */
static struct {
    atomic_int lines, cuts, snapshots, stops, refusals, ended, good;
    atomic_int state, power;      /* of the last snapshot */
    atomic_int snapshots_at_stop; /* how many came before it */
    atomic_uint requests_at_stop; /* that the amplifier had got when it had taken it */
    char why[1024], failure[1024];
} heard;

static void on_line(void *context, const device_t *device, const hyst_parameters_t *image, const char *why) {
    (void)context;
    if (device == NULL) {
        TEST_ASSERT_NULL(image);
        (void)snprintf(heard.why, sizeof heard.why, "%s", why);
    }
    atomic_fetch_add(device != NULL ? &heard.lines : &heard.cuts, 1);
}

static void on_snapshot(void *context, const device_t *device, const hyst_parameters_t *image,
                        const int64_t now[REGISTER_COUNT]) {
    (void)context;
    (void)device;
    (void)image;
    atomic_store(&heard.state, (int)now[INDEX_state]);
    atomic_store(&heard.power, (int)now[INDEX_amplifier_state]);
    atomic_fetch_add(&heard.snapshots, 1);
    if (atomic_exchange(&stop_at_snapshot, false)) {
        line_keeper_stop(keeper);
    }
}

/* The stream is whole: each block begins where the one before has ended. */
static struct {
    uint32_t next;
    atomic_int frames, gaps, captures;
    atomic_uint decimation;
} stream;

static void on_stream(void *context, const device_t *device, const hyst_parameters_t *image,
                      const stream_block_t *block) {
    (void)context;
    (void)device;
    (void)image;
    atomic_fetch_add(&stream.captures, block->restarted);
    atomic_fetch_add(&stream.gaps, block->first != (block->restarted ? 0 : stream.next) || block->lost > 0);
    stream.next = block->first + (uint32_t)block->frames;
    atomic_store(&stream.decimation, block->decimation);
    atomic_fetch_add(&stream.frames, (int)block->frames);
}

static void on_stopped(void *context, double seconds, const char *why) {
    (void)context;
    (void)seconds;
    atomic_store(&heard.snapshots_at_stop, atomic_load(&heard.snapshots));
    atomic_store(&heard.requests_at_stop, simulated_device_line()->requests);
    atomic_fetch_add(why == NULL ? &heard.stops : &heard.refusals, 1);
}

static const line_listener_t listener = {on_line, on_snapshot, on_stream, on_stopped, NULL};

static void wait_for(atomic_int *count, int least, const char *what) {
    for (const double until_s = monotonic_s() + PATIENCE_S; atomic_load(count) < least;) {
        TEST_ASSERT_TRUE_MESSAGE(monotonic_s() < until_s, what);
        sleep_until(monotonic_s() + 0.002);
    }
}

static void plug_in(void) {
    const char *const port = simulated_device_start(NULL);
    (void)unlink(PORT);
    TEST_ASSERT_EQUAL_INT(0, symlink(port, PORT));
}

/* 0..100 V and 0..100 um. */
static void give_image(hyst_parameters_t *image) {
    hyst_parameters_default(image);
    image->model_id = 1;
    image->drive_center_uv = image->drive_half_range_uv = 50000000;
    image->position_center_pm = image->position_half_range_pm = 50000000;
    image->transition_slew = 1 << 24;
}

void setUp(void) {
    memset(&heard, 0, sizeof heard);
    memset(&stream, 0, sizeof stream);
    options.port = PORT;
    options.timeout_s = TIMEOUT_S;
    plug_in();
    failure_t failure;
    keeper = line_keeper_start(&options, &listener, &failure);
    TEST_ASSERT_NOT_NULL(keeper);
    wait_for(&heard.lines, 1, "the line does not come");
}

void tearDown(void) {
    line_keeper_end(keeper);
    keeper = NULL;
    simulated_device_stop();
    (void)unlink(PORT);
}

static void on_ended(void *context, bool good, const failure_t *failure) {
    (void)context;
    (void)snprintf(heard.failure, sizeof heard.failure, "%s", failure->text);
    atomic_fetch_add(&heard.good, good);
    atomic_fetch_add(&heard.ended, 1);
}

typedef struct {
    const hyst_parameters_t *image;
    experiment_t experiment;
} long_play_t;

static bool play(device_t *device, void *context, failure_t *failure) {
    const long_play_t *p = context;
    recording_t recording;
    experiment_events_t events;
    const bool good = experiment_run(device, p->image, &p->experiment, &recording, &events, failure);
    if (good) {
        recording_free(&recording);
    }
    return good;
}

static bool run_sine(line_keeper_t *k, device_t *device, double frequency_hz, unsigned long cycles,
                     failure_t *failure) {
    hyst_parameters_t image;
    give_image(&image);
    const waveform_options_t waveform = {.name = "sine",
                                         .frequency_hz = frequency_hz,
                                         .amplitude = (double)NAN,
                                         .offset = (double)NAN,
                                         .cycles = cycles};
    const double range_v[2] = {0.0, 100.0};
    long_play_t played = {.image = &image, .experiment = {.mode = HYST_MODE_DIRECT}};
    const driving_t driving = {.play = play, .context = &played};
    if (!amplifier_image_write(device, &image, failure)) {
        return false;
    }
    line_keeper_new_image(k, &image);
    return waveform_make(&waveform, range_v, "V", &played.experiment.waveform, failure) &&
           driving_run(device, &driving, failure);
}

/* A recording that would take more than an hour. */
static bool long_run(line_keeper_t *k, device_t *device, void *context, failure_t *failure) {
    (void)context;
    return run_sine(k, device, 0.2, 1000, failure);
}

/* 20 s of the loop, which this device has in two. */
static bool short_run(line_keeper_t *k, device_t *device, void *context, failure_t *failure) {
    (void)context;
    return run_sine(k, device, 5.0, 100, failure);
}

static void begin(bool (*run)(line_keeper_t *, device_t *, void *, failure_t *)) {
    failure_t failure;
    const line_work_t work = {run, on_ended, NULL};
    TEST_ASSERT_TRUE_MESSAGE(line_keeper_give(keeper, &work, &failure), failure.text);
}

static void wait_until_it_plays(void) {
    for (const double until_s = monotonic_s() + PATIENCE_S; atomic_load(&heard.state) != LOOP_PLAYING;) {
        TEST_ASSERT_TRUE_MESSAGE(monotonic_s() < until_s, "it does not play");
        sleep_until(monotonic_s() + 0.002);
    }
}

static void test_snapshots_come_by_themselves(void) {
    wait_for(&heard.snapshots, 10, "no snapshots");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&heard.cuts));
}

static void test_snapshots_come_while_work_has_the_line(void) {
    begin(long_run);
    wait_until_it_plays();
    const int before = atomic_load(&heard.snapshots);
    wait_for(&heard.snapshots, before + 5, "no snapshots during work");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&heard.ended));
}

static void test_a_stop_overtakes_work_and_parks(void) {
    line_keeper_watch(keeper, true);
    begin(long_run);
    wait_until_it_plays();
    const unsigned before = simulated_device_line()->requests;
    line_keeper_stop(keeper);
    wait_for(&heard.stops, 1, "the stop is not taken");
    /* At most a snapshot or a block, or the request that it came before; parking by the work (park, timeout, lock); and
     * by the keeper. */
    const unsigned requests = atomic_load(&heard.requests_at_stop) - before;
    TEST_ASSERT_TRUE_MESSAGE(requests <= 6, "requests before the stop");
    wait_for(&heard.ended, 1, "the work does not end");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&heard.good));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(heard.failure, "stopped; the drive is stopped and parked"), heard.failure);
    const int snapshots = atomic_load(&heard.snapshots);
    wait_for(&heard.snapshots, snapshots + 2, "no snapshots after it");
    TEST_ASSERT_EQUAL_INT(LOOP_PARKED, atomic_load(&heard.state));
}

static void test_a_stop_without_work_is_taken_at_once(void) {
    line_keeper_stop(keeper);
    wait_for(&heard.stops, 1, "the stop is not taken");
    line_keeper_stop(keeper);
    wait_for(&heard.stops, 2, "a second stop is not taken");
}

/* As a run does when it ends: the stage of an amplifier that somebody has armed is off afterwards. */
static void test_a_stop_without_work_switches_off(void) {
    line_keeper_end(keeper);
    failure_t failure;
    hyst_parameters_t image;
    give_image(&image);
    device_t *device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE_MESSAGE(amplifier_image_write(device, &image, &failure) && device_arm(device, &failure),
                             failure.text);
    device_close(device);
    memset(&heard, 0, sizeof heard);
    keeper = line_keeper_start(&options, &listener, &failure);
    wait_for(&heard.snapshots, 2, "no snapshots");
    TEST_ASSERT_EQUAL_INT(AMPLIFIER_HOLD, atomic_load(&heard.power));
    line_keeper_stop(keeper);
    wait_for(&heard.stops, 1, "the stop is not taken");
    const int snapshots = atomic_load(&heard.snapshots);
    wait_for(&heard.snapshots, snapshots + 10, "no snapshots after it");
    TEST_ASSERT_EQUAL_INT(LOOP_PARKED, atomic_load(&heard.state));
    TEST_ASSERT_EQUAL_INT(AMPLIFIER_OFF, atomic_load(&heard.power));
}

static void test_only_one_work_at_a_time(void) {
    begin(long_run);
    failure_t failure;
    const line_work_t work = {long_run, on_ended, NULL};
    TEST_ASSERT_FALSE(line_keeper_give(keeper, &work, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "busy"), failure.text);
    line_keeper_stop(keeper);
    wait_for(&heard.ended, 1, "the work does not end");
}

/* Between runs without a gap, in a run the capture of that, and afterwards one's own again. */
static void test_the_stream_comes_by_itself_and_in_a_run(void) {
    line_keeper_watch(keeper, true);
    wait_for(&stream.frames, 2000, "no stream");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&stream.gaps));
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&stream.captures));
    begin(short_run);
    wait_for(&heard.ended, 1, "the work does not end");
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, atomic_load(&heard.good), heard.failure);
    wait_for(&stream.captures, 3, "the capture of the run, or the stream after it, is not read");
    const int frames = atomic_load(&stream.frames);
    wait_for(&stream.frames, frames + 1000, "no stream after the run");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&stream.gaps));
}

static void test_nobody_watches_and_nothing_is_read(void) {
    wait_for(&heard.snapshots, 10, "no snapshots");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&stream.frames));
    line_keeper_watch(keeper, true);
    wait_for(&stream.frames, 100, "no stream");
    line_keeper_watch(keeper, false);
    const int snapshots = atomic_load(&heard.snapshots);
    wait_for(&heard.snapshots, snapshots + 3, "no snapshots");
    const int frames = atomic_load(&stream.frames);
    wait_for(&heard.snapshots, snapshots + 10, "no snapshots");
    TEST_ASSERT_EQUAL_INT(frames, atomic_load(&stream.frames));
}

/* Somebody has armed the recorder, for a fault: it is his, and his settings stay. */
static void test_a_capture_that_waits_for_its_trigger_is_left_alone(void) {
    line_keeper_end(keeper);
    failure_t failure;
    device_t *device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE(device_unlock(device, CONTROL_PARAMETERS, &failure) &&
                     device_write(device, INDEX_capture_trigger, CAPTURE_AT_FAULT, &failure) &&
                     device_write(device, INDEX_capture_length, 1234, &failure) &&
                     device_command(device, COMMAND_ARM_CAPTURE, &failure));
    device_close(device);
    memset(&heard, 0, sizeof heard);
    keeper = line_keeper_start(&options, &listener, &failure);
    line_keeper_watch(keeper, true);
    wait_for(&heard.snapshots, 20, "no snapshots");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&stream.frames));
    line_keeper_end(keeper);
    keeper = NULL;
    int64_t state = 0;
    int64_t length = 0;
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE(device_read(device, INDEX_capture_state, &state, &failure) &&
                     device_read(device, INDEX_capture_length, &length, &failure));
    device_close(device);
    TEST_ASSERT_EQUAL_INT64(CAPTURE_ARMED, state);
    TEST_ASSERT_EQUAL_INT64(1234, length);
}

/* The loop makes more frames than the line carries: the stream is thinned until there is no gap. */
static void test_a_line_that_becomes_slow_thins_the_stream(void) {
    line_keeper_watch(keeper, true);
    wait_for(&stream.frames, 100, "no stream");
    const unsigned before = atomic_load(&stream.decimation);
    simulated_device_line()->samples_per_request = (int)(300U * before);
    for (const double until_s = monotonic_s() + PATIENCE_S; atomic_load(&stream.decimation) < 8 * before;) {
        TEST_ASSERT_TRUE_MESSAGE(monotonic_s() < until_s, "the stream is not thinned");
        sleep_until(monotonic_s() + 0.002);
    }
    const int frames = atomic_load(&stream.frames);
    wait_for(&stream.frames, frames + 2000, "no stream");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, atomic_load(&stream.gaps), "it was thinned before there was a gap");
}

static void test_a_stop_overtakes_the_stream(void) {
    line_keeper_watch(keeper, true);
    wait_for(&stream.frames, 1000, "no stream");
    for (int i = 1; i <= 20; i++) {
        const unsigned before = simulated_device_line()->requests;
        line_keeper_stop(keeper);
        wait_for(&heard.stops, i, "the stop is not taken");
        /* The request that is on the line, one that was about to be, and the stop. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT(3, atomic_load(&heard.requests_at_stop) - before);
    }
}

static void test_a_stop_right_after_work_was_given_stops_it(void) {
    for (int i = 1; i <= 20; i++) {
        begin(long_run);
        line_keeper_stop(keeper);
        wait_for(&heard.ended, i, "the work does not end");
        wait_for(&heard.stops, i, "the stop is not taken");
    }
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&heard.good));
}

/* The snapshot comes before the first request that goes out, whatever becomes of that one. */
static bool run_that_is_stopped_at_its_first_request(line_keeper_t *k, device_t *device, void *context,
                                                     failure_t *failure) {
    (void)k;
    (void)context;
    hyst_parameters_t image;
    give_image(&image);
    long_play_t played = {
        .image = &image,
        .experiment = {
            .mode = HYST_MODE_DIRECT,
            .waveform = {
                .kind = WAVEFORM_SINE, .frequency_hz = 0.2, .amplitude = 10.0, .offset = 50.0, .cycles = 1000}}};
    const driving_t driving = {.play = play, .context = &played};
    atomic_store(&stop_at_snapshot, true);
    return driving_run(device, &driving, failure);
}

static void test_a_stop_at_the_first_request_of_a_run_stops_it(void) {
    begin(short_run); /* which leaves an image */
    wait_for(&heard.ended, 1, "the work does not end");
    begin(run_that_is_stopped_at_its_first_request);
    wait_for(&heard.ended, 2, "the stop is lost");
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&heard.good));
    TEST_ASSERT_EQUAL_STRING("stopped", heard.failure);
}

static void test_a_line_that_is_unplugged_comes_back(void) {
    simulated_device_stop();
    wait_for(&heard.cuts, 1, "the cut is not noticed");
    TEST_ASSERT_TRUE(heard.why[0] != '\0');
    failure_t failure;
    const line_work_t work = {long_run, on_ended, NULL};
    TEST_ASSERT_FALSE(line_keeper_give(keeper, &work, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "no line"), failure.text);
    plug_in();
    wait_for(&heard.lines, 2, "the line does not come back");
    const int snapshots = atomic_load(&heard.snapshots);
    wait_for(&heard.snapshots, snapshots + 2, "no snapshots after it");
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, atomic_load(&heard.cuts), "said more than once");
}

static void test_a_stop_during_a_cut_is_the_first_thing_after_it(void) {
    begin(long_run);
    wait_until_it_plays();
    simulated_device_fault(LINE_LOSES_REQUEST, 0, 1000000);
    wait_for(&heard.cuts, 1, "the cut is not noticed");
    wait_for(&heard.ended, 1, "the work does not end");
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&heard.good));
    line_keeper_stop(keeper);
    sleep_until(monotonic_s() + 3.0 * TIMEOUT_S);
    TEST_ASSERT_EQUAL_INT(0, atomic_load(&heard.stops));
    const int snapshots = atomic_load(&heard.snapshots);
    simulated_device_fault(LINE_GOOD, 0, 0);
    wait_for(&heard.stops, 1, "the stop is forgotten");
    /* One may have been on the line already. */
    TEST_ASSERT_TRUE_MESSAGE(atomic_load(&heard.snapshots_at_stop) <= snapshots + 1, "something came before the stop");
}

static void test_the_end_parks_what_is_driven(void) {
    begin(long_run);
    wait_until_it_plays();
    line_keeper_end(keeper);
    keeper = NULL;
    TEST_ASSERT_EQUAL_INT(1, atomic_load(&heard.ended));
    failure_t failure;
    device_t *const device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    int64_t now[REGISTER_COUNT];
    TEST_ASSERT_TRUE(device_read_telemetry(device, now, &failure));
    device_close(device);
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, now[INDEX_state]);
}

/* What it had in force may be gone: the line comes anew, with what is in force. */
static void test_a_restart_is_told_of(void) {
    for (int supply = 0; supply < 2; supply++) {
        const int lines = atomic_load(&heard.lines);
        simulated_device_line()->supply_goes = supply != 0;
        simulated_device_line()->restart_after = 4;
        wait_for(&heard.lines, lines + 1, "the restart goes unnoticed");
        TEST_ASSERT_EQUAL_INT(supply + 1, atomic_load(&heard.cuts));
        TEST_ASSERT_EQUAL_STRING("the amplifier restarted: what was set in it and not stored is gone", heard.why);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_snapshots_come_by_themselves);
    RUN_TEST(test_snapshots_come_while_work_has_the_line);
    RUN_TEST(test_a_stop_overtakes_work_and_parks);
    RUN_TEST(test_a_stop_without_work_is_taken_at_once);
    RUN_TEST(test_a_stop_without_work_switches_off);
    RUN_TEST(test_only_one_work_at_a_time);
    RUN_TEST(test_the_stream_comes_by_itself_and_in_a_run);
    RUN_TEST(test_nobody_watches_and_nothing_is_read);
    RUN_TEST(test_a_capture_that_waits_for_its_trigger_is_left_alone);
    RUN_TEST(test_a_line_that_becomes_slow_thins_the_stream);
    RUN_TEST(test_a_stop_overtakes_the_stream);
    RUN_TEST(test_a_stop_right_after_work_was_given_stops_it);
    RUN_TEST(test_a_stop_at_the_first_request_of_a_run_stops_it);
    RUN_TEST(test_a_line_that_is_unplugged_comes_back);
    RUN_TEST(test_a_stop_during_a_cut_is_the_first_thing_after_it);
    RUN_TEST(test_a_restart_is_told_of);
    RUN_TEST(test_the_end_parks_what_is_driven);
    return UNITY_END();
}
