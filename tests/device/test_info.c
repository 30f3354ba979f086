/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What `hyst info` makes of registers. */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "interface/info_run.h"
#include "simulated_device.h"
#include "unity.h"

static device_t *device;
static failure_t failure;

static void must(bool done) {
    TEST_ASSERT_TRUE_MESSAGE(done, failure.text);
}

void setUp(void) {
    device_options_t options = DEVICE_OPTIONS_DEFAULT;
    failure.text[0] = '\0';
    options.port = simulated_device_start(NULL);
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    must(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure));
}

void tearDown(void) {
    device_close(device);
    simulated_device_stop();
}

static json_t *read_current(info_t *info) {
    must(info_read(device, info, &failure));
    json_t *all = info_to_json(info);
    json_t *current = json_incref(json_object_get(all, "current"));
    TEST_ASSERT_NOT_NULL(current);
    json_decref(all);
    return current;
}

static double number(const json_t *object, const char *key) {
    const json_t *value = json_object_get(object, key);
    TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
    return json_number_value(value);
}

/* 150 V of range into 3 uF at 10 kHz: a step of a thousandth of full scale, which is half the range, is 75 mV in
 * 100 us, so 2.25 mA. */
static void test_the_current_is_in_milliamperes(void) {
    info_t info;
    hyst_parameters_t image;
    hyst_parameters_default(&image);
    image.drive_center_uv = image.drive_half_range_uv = 75000000;
    image.drive_park = 1 << 28; /* elsewhere: the drive moves there, by the image's slew */
    must(amplifier_image_write(device, &image, &failure));
    json_t *current = read_current(&info);
    TEST_ASSERT_TRUE_MESSAGE(json_is_null(current), "nobody said what is connected");
    json_decref(current);
    must(device_write(device, INDEX_capacitance, 3000000, &failure));
    must(device_write(device, INDEX_current_limit, 2147484, &failure));
    must(device_write(device, INDEX_drive_slew, 21474836, &failure)); /* a hundredth of full scale */
    current = read_current(&info);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3e-6, number(current, "capacitance_f"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 2.25, number(current, "limit_ma"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 22.5, number(current, "peak_limit_ma"));
    info.now[INDEX_current_average] = 214748365; /* a tenth of full scale */
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 225.0, info_milliamperes(&info, info.now[INDEX_current_average]));
    TEST_ASSERT_TRUE(number(current, "peak_ma") <=
                     2.25 * 1000.0 * image.transition_slew / 2147483648.0 * (1.0 + 1e-9)); /* doubles are rounded */
    TEST_ASSERT_TRUE(number(current, "peak_ma") > 0.0);
    TEST_ASSERT_TRUE(number(current, "average_ma") <= number(current, "peak_ma"));
    json_decref(current);
    must(device_write(device, INDEX_current_limit, 0, &failure));
    current = read_current(&info);
    TEST_ASSERT_TRUE_MESSAGE(json_is_null(json_object_get(current, "limit_ma")), "none");
    json_decref(current);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_current_is_in_milliamperes);
    return UNITY_END();
}
