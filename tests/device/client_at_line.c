/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "client_at_line.h"
#include "amplifier/device/opening.h"
#include "simulated_device.h"
#include "unity.h"
#include <string.h>

device_options_t options;
device_t *device;
failure_t failure;

void client_at_line_open(void) {
    options = (device_options_t)DEVICE_OPTIONS_DEFAULT;
    options.port = simulated_device_start(NULL);
    options.timeout_s = TIMEOUT_S;
    device = NULL;
    failure.text[0] = '\0';
}

void client_at_line_close(void) {
    device_close(device);
    simulated_device_stop();
}

void open_device(void) {
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE_MESSAGE(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure), failure.text);
}

void expect_line(const char *part) {
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, part), failure.text);
    TEST_ASSERT_NULL_MESSAGE(strchr(failure.text, '\n'), failure.text);
}

void refuses_to_open(const char *part) {
    device = device_open(&options, &failure);
    TEST_ASSERT_NULL(device);
    expect_line(part);
}

int64_t read_register(int which) {
    int64_t value = -1;
    TEST_ASSERT_TRUE_MESSAGE(device_read(device, which, &value, &failure), failure.text);
    return value;
}
