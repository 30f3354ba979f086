/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What is kept of an amplifier, put back, and told of a difference; and a table that plays on. */
#include "amplifier/amplifier_image.h"
#include "amplifier/backup.h"
#include "amplifier/device/arming.h"
#include "amplifier/device/opening.h"
#include "amplifier/driving.h"
#include "amplifier/experiment.h"
#include "amplifier/image_difference.h"
#include "loop/telemetry.h"
#include "motion/source.h"
#include "simulated_device.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <signal.h>
#include <string.h>

static device_t *device;
static hyst_parameters_t image;
static failure_t failure;

static void must(bool done) {
    TEST_ASSERT_TRUE_MESSAGE(done, failure.text);
}

static void start_device(void) {
    device_options_t options = DEVICE_OPTIONS_DEFAULT;
    options.port = simulated_device_start(NULL);
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE_MESSAGE(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure), failure.text);
}

static void stop_device(void) {
    device_close(device);
    device = NULL;
    simulated_device_stop();
}

/* 0..100 V and -10..90 um. */
void setUp(void) {
    failure.text[0] = '\0';
    start_device();
    hyst_parameters_default(&image);
    image.model_id = 7;
    image.drive_center_uv = image.drive_half_range_uv = 50000000;
    image.position_center_pm = 40000000;
    image.position_half_range_pm = 50000000;
}

void tearDown(void) {
    stop_device();
}

static int64_t value_of(int which) {
    int64_t value = 0;
    must(device_read(device, which, &value, &failure));
    return value;
}

static void test_a_backup_makes_another_amplifier_the_same(void) {
    backup_done_t done;
    must(amplifier_image_write(device, &image, &failure));
    must(device_write(device, INDEX_setpoint_slew, 12345, &failure));
    must(device_write(device, INDEX_current_limit, 777777, &failure));
    must(device_write(device, INDEX_capture_signals, 5, &failure));
    json_t *backup = backup_read(device, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(backup, failure.text);
    stop_device();
    start_device();
    TEST_ASSERT_NOT_EQUAL(12345, value_of(INDEX_setpoint_slew));
    must(backup_write(device, backup, "backup", &done, &failure));
    TEST_ASSERT_TRUE(done.image);
    TEST_ASSERT_EQUAL_UINT(0, done.not_there);
    TEST_ASSERT_EQUAL_UINT(json_object_size(json_object_get(backup, "settings")), done.settings);
    TEST_ASSERT_EQUAL_INT64(12345, value_of(INDEX_setpoint_slew));
    TEST_ASSERT_EQUAL_INT64(777777, value_of(INDEX_current_limit));
    TEST_ASSERT_EQUAL_INT64(5, value_of(INDEX_capture_signals));
    TEST_ASSERT_EQUAL_INT64(7, value_of(INDEX_active_model_id));
    TEST_ASSERT_EQUAL_INT64(LOOP_PARKED, value_of(INDEX_state));
    json_decref(backup);
}

static void test_a_damaged_backup_changes_nothing(void) {
    backup_done_t done;
    must(amplifier_image_write(device, &image, &failure));
    image.model_id = 8;
    json_t *backup = backup_read(device, &failure);
    json_array_set_new(json_object_get(backup, "image"), 9, json_integer(99)); /* the CRC says so */
    must(amplifier_image_write(device, &image, &failure));
    TEST_ASSERT_FALSE(backup_write(device, backup, "backup", &done, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "backup: image"), failure.text);
    TEST_ASSERT_EQUAL_INT64(8, value_of(INDEX_active_model_id));
    json_object_set_new(backup, "format", json_string("another"));
    TEST_ASSERT_FALSE(backup_write(device, backup, "backup", &done, &failure));
    json_decref(backup);
}

/* Settings of another firmware are counted, and no reason to refuse the rest. */
static void test_settings_that_are_not_there(void) {
    backup_done_t done;
    json_t *backup = backup_read(device, &failure);
    json_object_set_new(json_object_get(backup, "settings"), "of_tomorrow", json_integer(1));
    must(backup_write(device, backup, "backup", &done, &failure));
    TEST_ASSERT_FALSE(done.image);
    TEST_ASSERT_EQUAL_UINT(1, done.not_there);
    json_decref(backup);
}

static void set_limits(int lower, int64_t low, int64_t high) {
    int64_t value[REGISTER_COUNT];
    value[lower] = low;
    value[lower + 1] = high;
    must(device_write_span(device, lower, lower + 1, value, &failure));
}

static void expect_limits(int lower, int64_t low, int64_t high) {
    TEST_ASSERT_EQUAL_INT64(low, value_of(lower));
    TEST_ASSERT_EQUAL_INT64(high, value_of(lower + 1));
}

/* Limits in force that have nothing in common with those of the backup, above and below. */
static void test_limits_go_in_whatever_is_in_force(void) {
    const int lower[] = {INDEX_reference_low, INDEX_drive_low};
    for (size_t i = 0; i < sizeof lower / sizeof lower[0]; i++) {
        for (int up = 0; up < 2; up++) {
            const int64_t backed[2] = {up ? 1288490188 : -1717986918, up ? 1717986918 : -1288490188};
            const int64_t present[2] = {up ? INT32_MIN : -1073741824, up ? 1073741824 : INT32_MAX};
            backup_done_t done;
            image.drive_park = (hyst_q31_t)(up ? 1500000000 : -1500000000);
            must(amplifier_image_write(device, &image, &failure));
            set_limits(lower[i], backed[0], backed[1]);
            json_t *backup = backup_read(device, &failure);
            TEST_ASSERT_NOT_NULL_MESSAGE(backup, failure.text);
            set_limits(lower[i], INT32_MIN, INT32_MAX);
            image.drive_park = 0;
            must(amplifier_image_write(device, &image, &failure));
            set_limits(lower[i], present[0], present[1]);
            must(backup_write(device, backup, "backup", &done, &failure));
            TEST_ASSERT_EQUAL_UINT(json_object_size(json_object_get(backup, "settings")), done.settings);
            expect_limits(lower[i], backed[0], backed[1]);
            set_limits(lower[i], INT32_MIN, INT32_MAX);
            json_decref(backup);
        }
    }
}

/* What a refused image leaves: the limits that were in force. */
static void test_a_refused_image_leaves_the_limits(void) {
    backup_done_t done;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    json_t *list = json_array();
    must(amplifier_image_write(device, &image, &failure));
    json_t *backup = backup_read(device, &failure);
    json_t *settings = json_object_get(backup, "settings");
    image.drive_park = 1500000000;
    image.sample_rate_mhz = 5000000;
    const size_t count = hyst_parameters_encode(&image, words, HYST_IMAGE_MAX_WORDS);
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(list, json_integer((json_int_t)words[i]));
    }
    json_object_set_new(backup, "image", list);
    json_object_set_new(settings, "drive_low", json_integer(1288490188));
    json_object_set_new(settings, "drive_high", json_integer(1717986918));
    set_limits(INDEX_drive_low, -5, 1073741824);
    TEST_ASSERT_FALSE(backup_write(device, backup, "backup", &done, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "made for 5000 samples per second"), failure.text);
    expect_limits(INDEX_drive_low, -5, 1073741824);
    json_decref(backup);
}

static void expect_refused(json_t *backup, const char *name, int64_t value, const char *part) {
    backup_done_t done;
    json_t *settings = json_object_get(backup, "settings");
    json_t *right = json_incref(json_object_get(settings, name));
    json_object_set_new(settings, name, json_integer((json_int_t)value));
    TEST_ASSERT_FALSE_MESSAGE(backup_write(device, backup, "kept.json", &done, &failure), name);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, part), failure.text);
    json_object_set_new(settings, name, right);
}

static void test_what_fits_into_no_register_changes_nothing(void) {
    must(amplifier_image_write(device, &image, &failure));
    must(device_write(device, INDEX_capture_decimation, 500, &failure));
    must(device_write(device, INDEX_setpoint_slew, 12345, &failure));
    set_limits(INDEX_reference_low, 0, INT32_MAX);
    json_t *backup = backup_read(device, &failure);
    image.model_id = 8;
    must(amplifier_image_write(device, &image, &failure));
    must(device_write(device, INDEX_setpoint_slew, 54321, &failure));
    expect_refused(backup, "capture_decimation", 65536,
                   "kept.json: settings: capture_decimation is 65536, and the register takes 0 to 65535");
    expect_refused(backup, "capture_decimation", -1, "kept.json: settings: capture_decimation is -1, ");
    expect_refused(backup, "source_increment", 4294967296, "source_increment is 4294967296, ");
    expect_refused(backup, "drive_high", 2147483648,
                   "drive_high is 2147483648, and the register takes -2147483648 to 2147483647");
    expect_refused(backup, "reference_high", -5, "reference_low is 0, not below reference_high, -5");
    expect_refused(backup, "drive_high", -1, "do not hold drive_park of the image, 0");
    TEST_ASSERT_EQUAL_INT64(8, value_of(INDEX_active_model_id));
    TEST_ASSERT_EQUAL_INT64(54321, value_of(INDEX_setpoint_slew));
    TEST_ASSERT_EQUAL_INT64(500, value_of(INDEX_capture_decimation));
    TEST_ASSERT_FALSE(device_write(device, INDEX_capture_decimation, 65536, &failure));
    TEST_ASSERT_EQUAL_STRING("register capture_decimation takes 0 to 65535, not 65536", failure.text);
    TEST_ASSERT_EQUAL_INT64(500, value_of(INDEX_capture_decimation));
    json_decref(backup);
}

static const image_difference_t *difference_of(const image_difference_t *list, size_t count, const char *field) {
    for (size_t i = 0; i < count; i++) {
        if (strcmp(list[i].field, field) == 0) {
            return &list[i];
        }
    }
    return NULL;
}

static void test_differences_are_in_units(void) {
    image_difference_t list[IMAGE_DIFFERENCES_MOST];
    hyst_parameters_t other = image;
    TEST_ASSERT_EQUAL_UINT(0, image_differences(&image, &other, list));
    other.drive_high = 1 << 30;
    other.pi_operators = 2;
    other.pi_weight[1] = HYST_Q28_ONE;
    other.pi_weight[2] = HYST_Q28_ONE / 2;
    other.pi_threshold[0] = 1 << 29;
    other.pi_threshold[1] = 1 << 30;
    const size_t count = image_differences(&image, &other, list);
    TEST_ASSERT_EQUAL_UINT(4, count);
    const image_difference_t *high = difference_of(list, count, "drive_high");
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 100.0, high->before);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 75.0, high->after);
    const image_difference_t *weight = difference_of(list, count, "pi_weight");
    TEST_ASSERT_EQUAL_UINT(2, weight->differing);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, weight->after); /* um/V: 50 um over 50 V */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 25.0, difference_of(list, count, "pi_threshold")->after);
}

/* Only while off; waits for the ramp that a commit or a disarmed amplifier is still on. */
static void test_an_image_is_stored_once_the_amplifier_is_off(void) {
    must(amplifier_image_write(device, &image, &failure));
    TEST_ASSERT_FALSE(amplifier_image_store(device, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "the amplifier is on, and stores its image only while it is off"),
                                 failure.text);
    TEST_ASSERT_EQUAL_INT64(STORE_NONE, value_of(INDEX_store_state));
    must(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    must(device_write(device, INDEX_setpoint, 1 << 30, &failure));
    must(device_command(device, COMMAND_DISARM, &failure));
    while (value_of(INDEX_amplifier_state) != AMPLIFIER_OFF) {
    }
    image.drive_park = 1 << 29;
    image.transition_slew = 1 << 16; /* 0.8 s of this loop's time */
    must(amplifier_image_write(device, &image, &failure));
    must(amplifier_image_store(device, &failure));
    TEST_ASSERT_EQUAL_INT64(STORE_SAVED, value_of(INDEX_store_state));
    TEST_ASSERT_EQUAL_INT64(1, value_of(INDEX_store_sequence));
}

/* As after a run: the output is on its way to park still. */
static void test_what_is_on_its_way_off_is_waited_for(void) {
    image.transition_slew = 1 << 16;
    must(amplifier_image_write(device, &image, &failure));
    must(device_write(device, INDEX_mode, HYST_MODE_DIRECT, &failure));
    must(device_write(device, INDEX_setpoint, 1 << 30, &failure));
    must(device_command(device, COMMAND_DISARM, &failure));
    TEST_ASSERT_EQUAL_INT64(AMPLIFIER_STOP, value_of(INDEX_amplifier_state));
    must(amplifier_image_store(device, &failure));
    TEST_ASSERT_EQUAL_INT64(STORE_SAVED, value_of(INDEX_store_state));
}

static bool play_nothing(device_t *d, void *context, failure_t *f) {
    (void)d;
    (void)context;
    return fail(f, "nothing to play");
}

/* A signal that comes after a run ends no request of who goes on with the device. */
static void test_a_run_that_ends_early_no_longer_watches_for_the_stop(void) {
    volatile sig_atomic_t stop = 0;
    const driving_t driving = {.play = play_nothing, .stop = &stop};
    for (unsigned lost = 0; lost < 2; lost++) {
        stop = 0;
        simulated_device_fault(LINE_LOSES_REQUEST, 0, lost == 0 ? 3 : 0); /* the unlocking, all tries of it */
        TEST_ASSERT_FALSE(driving_run(device, &driving, &failure));
        stop = SIGINT;
        (void)value_of(INDEX_mode);
        TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_unlocked));
        must(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure));
    }
}

static bool start_table(device_t *d, void *table, failure_t *f) {
    return experiment_start_table(d, &image, table, f);
}

static void test_a_table_is_read_back_and_plays_on(void) {
    const breakpoint_t corner[] = {{500, 60.0}, {500, 20.0}, {500, 40.0}};
    experiment_table_t table = {
        .mode = HYST_MODE_COMPENSATE, .start = 40.0, .corner = corner, .corners = 3, .passes = 0};
    must(amplifier_image_write(device, &image, &failure));
    const driving_t driving = {.play = start_table, .context = &table, .silence_s = 30.0};
    must(driving_run(device, &driving, &failure));
    TEST_ASSERT_EQUAL_INT64(LOOP_PLAYING, value_of(INDEX_state));
    TEST_ASSERT_EQUAL_INT64(SOURCE_BREAKPOINTS, value_of(INDEX_source));
    TEST_ASSERT_EQUAL_INT64(30000, value_of(INDEX_watchdog));
    uint16_t held[12];
    must(device_read_block(device, ADDRESS_waveform, 0, 12, held, &failure));
    TEST_ASSERT_EQUAL_UINT16(500, held[1]);
    TEST_ASSERT_INT_WITHIN(2, (int)(0.4 * 32768.0), (int16_t)held[2]);
}

/* Each save erases a sector: one whose answer was lost, or came late, is not made again. */
static void test_a_save_is_not_repeated_for_its_answer(void) {
    static const line_fault_t faults[] = {LINE_LOSES_ANSWER, LINE_DELAYS, LINE_LOSES_REQUEST};
    must(amplifier_image_write(device, &image, &failure) && device_command(device, COMMAND_DISARM, &failure) &&
         device_expect_off(device, "it", &failure));
    simulated_device_line()->delay_ms = 800; /* where the line waits 0.5 s */
    for (unsigned i = 0; i < 3; i++) {
        simulated_device_line()->saves = 0;
        simulated_device_fault(faults[i], 3, 1); /* after the state, the key and the store's registers */
        must(amplifier_image_store(device, &failure));
        TEST_ASSERT_EQUAL_UINT(0, simulated_device_line()->times);
        TEST_ASSERT_EQUAL_UINT(1, simulated_device_line()->saves);
        TEST_ASSERT_EQUAL_INT64(i + 1, value_of(INDEX_store_sequence));
    }
}

/* An older file has the communication timeout, which a start has anew. */
static void test_the_communication_timeout_is_left_out(void) {
    backup_done_t done;
    must(amplifier_image_write(device, &image, &failure) && device_write(device, INDEX_watchdog, 0, &failure));
    json_t *backup = backup_read(device, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(backup, failure.text);
    TEST_ASSERT_NULL(json_object_get(json_object_get(backup, "settings"), "watchdog"));
    json_object_set_new(json_object_get(backup, "settings"), "watchdog", json_integer(60000));
    must(backup_write(device, backup, "backup", &done, &failure));
    TEST_ASSERT_TRUE(done.watchdog);
    TEST_ASSERT_EQUAL_UINT(0, done.not_there);
    TEST_ASSERT_EQUAL_INT64(0, value_of(INDEX_watchdog));
    json_decref(backup);
}

/* The amplifier alone knows its ranges: what it has taken until then is in the line. */
static void test_a_setting_that_is_refused_says_what_is_in_force(void) {
    backup_done_t done;
    must(amplifier_image_write(device, &image, &failure));
    json_t *backup = backup_read(device, &failure);
    json_object_set_new(json_object_get(backup, "settings"), "health_looks", json_integer(200));
    TEST_ASSERT_FALSE(backup_write(device, backup, "backup", &done, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "backup: the image and "), failure.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, " settings of it are in force, and nothing is stored: "),
                                 failure.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "refuses writing 200 to register health_looks"), failure.text);
    json_decref(backup);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_backup_makes_another_amplifier_the_same);
    RUN_TEST(test_a_damaged_backup_changes_nothing);
    RUN_TEST(test_settings_that_are_not_there);
    RUN_TEST(test_limits_go_in_whatever_is_in_force);
    RUN_TEST(test_a_refused_image_leaves_the_limits);
    RUN_TEST(test_what_fits_into_no_register_changes_nothing);
    RUN_TEST(test_differences_are_in_units);
    RUN_TEST(test_an_image_is_stored_once_the_amplifier_is_off);
    RUN_TEST(test_a_save_is_not_repeated_for_its_answer);
    RUN_TEST(test_the_communication_timeout_is_left_out);
    RUN_TEST(test_a_setting_that_is_refused_says_what_is_in_force);
    RUN_TEST(test_what_is_on_its_way_off_is_waited_for);
    RUN_TEST(test_a_run_that_ends_early_no_longer_watches_for_the_stop);
    RUN_TEST(test_a_table_is_read_back_and_plays_on);
    return UNITY_END();
}
