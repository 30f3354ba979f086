/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_at_line.h"
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "base/monotonic_clock.h"
#include "loop/telemetry.h"
#include "simulated_device.h"
#include "unity.h"
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* For an answer of the simulated amplifier: a hundred times what it takes when nothing is wrong. */
#define TIMEOUT_S    0.1
#define TIMEOUT_TEXT "0.1"

device_t *device;
device_options_t options = DEVICE_OPTIONS_DEFAULT;
failure_t failure;
pid_t process;
const char *standard_output;
char errors[4096];
static int errors_of;

void must(bool done) {
    TEST_ASSERT_TRUE_MESSAGE(done, failure.text);
}

/* The test and the command take turns on the line. */
void take_line(void) {
    device = device_open(&options, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(device, failure.text);
    TEST_ASSERT_TRUE_MESSAGE(device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure), failure.text);
}

void leave_line(void) {
    device_close(device);
    device = NULL;
}

int64_t value_of(int which) {
    int64_t value = 0;
    must(device_read(device, which, &value, &failure));
    return value;
}

void expect_goes_off(void) {
    const double until_s = monotonic_s() + PATIENCE_S;
    while (value_of(INDEX_amplifier_state) == AMPLIFIER_STOP && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + 0.01);
    }
    TEST_ASSERT_EQUAL_INT64(AMPLIFIER_OFF, value_of(INDEX_amplifier_state));
}

void push(uint32_t model_id) {
    hyst_parameters_t image;
    hyst_parameters_default(&image);
    image.model_id = model_id;
    image.drive_center_uv = image.drive_half_range_uv = 50000000;
    image.position_center_pm = image.position_half_range_pm = 50000000;
    image.drive_park = (hyst_q31_t)(-0.8 * 0x1p31);
    image.transition_slew = 1 << 24;
    take_line();
    must(amplifier_image_write(device, &image, &failure));
    leave_line();
}

void forget(void) {
    (void)close(errors_of);
    process = 0;
}

void start(const char *const argument[]) {
    const char *all[32] = {HYST_TOOL};
    size_t count = 1;
    while (argument[count - 1] != NULL) {
        all[count] = argument[count - 1];
        count++;
    }
    all[count++] = "--port";
    all[count++] = options.port;
    all[count++] = "--timeout";
    all[count++] = TIMEOUT_TEXT;
    int ends[2];
    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    process = fork();
    if (process == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        const int nowhere = open(standard_output, O_WRONLY);
        (void)dup2(nowhere, STDOUT_FILENO);
        (void)dup2(ends[1], STDERR_FILENO);
        (void)execv(HYST_TOOL, (char *const *)(size_t)all);
        _exit(127);
    }
    TEST_ASSERT_TRUE(process > 0);
    (void)close(ends[1]);
    errors_of = ends[0];
}

int end(void) {
    int status = 0;
    size_t length = 0;
    ssize_t got;
    while (length + 1 < sizeof errors && (got = read(errors_of, errors + length, sizeof errors - 1 - length)) > 0) {
        length += (size_t)got;
    }
    errors[length] = '\0';
    TEST_ASSERT_EQUAL_INT(process, waitpid(process, &status, 0));
    forget();
    return status;
}

void wait_for_start(void) {
    const double until_s = monotonic_s() + PATIENCE_S;
    while (simulated_device_line()->starts == 0) {
        if (monotonic_s() > until_s) {
            (void)kill(process, SIGKILL);
            (void)end();
            TEST_FAIL_MESSAGE(errors[0] != '\0' ? errors : "nothing was started, and the command says nothing");
        }
        sleep_until(monotonic_s() + 0.01);
    }
}

void expect_error(const char *part) {
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(errors, part), errors);
    TEST_ASSERT_EQUAL_PTR_MESSAGE(errors + strlen(errors) - 1, strchr(errors, '\n'), "not one line");
}

void wait_for_line(void) {
    size_t length = 0;
    while (length + 1 < sizeof errors && read(errors_of, errors + length, 1) == 1 && errors[length] != '\n') {
        length++;
    }
    errors[length] = '\0';
}

void command_at_line_open(void) {
    options.port = simulated_device_start(NULL);
    options.timeout_s = TIMEOUT_S;
    failure.text[0] = '\0';
    standard_output = "/dev/null";
    push(1);
}

void command_at_line_close(void) {
    if (process > 0) {
        (void)kill(process, SIGKILL);
        (void)waitpid(process, NULL, 0);
        forget();
    }
    leave_line();
    simulated_device_stop();
}
