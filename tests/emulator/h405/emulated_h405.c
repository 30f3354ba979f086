/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "emulated_h405.h"
#include "amplifier/device/opening.h"
#include "bench/emulator.h"
#include "command_line/print.h"
#include "unity.h"
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

device_t *h405_device;
peripheral_log_t h405_log;

static emulator_t emulator = EMULATOR_NONE;

/* In the working folder. The log stays there, to be looked at. */
static const char log_path[] = "h405.log";
static const struct sockaddr_un debugger = {.sun_family = AF_UNIX, .sun_path = "h405.debugger"};

void check(bool ok, const failure_t *failure) {
    TEST_ASSERT_TRUE_MESSAGE(ok, failure->text);
}

static void start(const char *image) {
    failure_t failure;
    (void)unlink(log_path);
    (void)unlink(debugger.sun_path);
    TEST_ASSERT_EQUAL(0, setenv("HYST_EMULATOR_LOG", log_path, 1));
    TEST_ASSERT_EQUAL(0, setenv("HYST_EMULATOR_DEBUGGER", debugger.sun_path, 1));
    check(emulator_start(&emulator, LOGGED_EMULATOR, image, &failure), &failure);
    TEST_ASSERT_TRUE_MESSAGE(peripheral_log_open(&h405_log, log_path), "the emulator writes no log");
}

static void open_line(void) {
    failure_t failure;
    device_options_t options = DEVICE_OPTIONS_DEFAULT;
    options.port = emulator.port;
    options.timeout_s = 5.0;
    h405_device = device_open(&options, &failure);
    check(h405_device != NULL, &failure);
    check(device_unlock(h405_device, CONTROL_PARAMETERS | CONTROL_OUTPUT, &failure), &failure);
}

void h405_start(void) {
    start(H405_IMAGE);
    h405_wait(2); /* the line is deaf until the clocks' waits are over */
    open_line();
}

/* Nobody stands at its converters: there is no sample. */
void bench_start(void) {
    start(BENCH_IMAGE);
    converter_close(&emulator.line);
    open_line();
}

void h405_write(unsigned index, int64_t value) {
    failure_t failure;
    check(device_write(h405_device, (int)index, value, &failure), &failure);
}

void h405_wait(size_t codes) {
    TEST_ASSERT_TRUE_MESSAGE(peripheral_log_wait(&h405_log, codes, PATIENCE_S), "the loop stands still");
}

/* One packet of the gdb remote serial protocol: $text#checksum. */
static void tell_debugger(int line, const char *text) {
    unsigned sum = 0;
    for (const char *c = text; *c != '\0'; c++) {
        sum += (unsigned char)*c;
    }
    char packet[64];
    const int length = snprintf(packet, sizeof packet, "+$%s#%02x", text, sum & 0xFFU);
    TEST_ASSERT_EQUAL(length, send(line, packet, (size_t)length, MSG_NOSIGNAL));
}

/* A core register, by its number. Connecting stops the processor, detaching lets it go on. */
static void set_register(unsigned number, uint32_t value) {
    char write[32];
    const int line = socket(AF_UNIX, SOCK_STREAM, 0);
    const struct timeval patience = {.tv_sec = 10};
    TEST_ASSERT_GREATER_OR_EQUAL(0, line);
    TEST_ASSERT_EQUAL(0, setsockopt(line, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience));
    TEST_ASSERT_EQUAL(0, connect(line, (const struct sockaddr *)&debugger, sizeof debugger));
    (void)snprintf(write, sizeof write, "P%x=%08x", number, __builtin_bswap32(value)); /* the lowest byte first */
    tell_debugger(line, "qXfer:features:read:target.xml:0,ffb"); /* single registers are for those who know them */
    tell_debugger(line, write);
    char answer = '\0';
    while (answer != 'K' && recv(line, &answer, 1, 0) == 1) { /* until the end of OK */
    }
    TEST_ASSERT_EQUAL_HEX8_MESSAGE('K', answer, "the debugger's stub does not write a register");
    tell_debugger(line, "D");
    (void)recv(line, &answer, 1, 0);
    (void)close(line);
}

void h405_crash(void) {
    set_register(15, 0x60000000);
}

void h405_overflow_stack(void) {
    set_register(13, 0x20000080);
}

void h405_end(void) {
    failure_t failure;
    device_close(h405_device);
    h405_device = NULL;
    peripheral_log_close(&h405_log);
    if (emulator.process > 0 && !emulator_stop(&emulator, &failure)) {
        (void)failure_print(&failure);
    }
    (void)unlink(debugger.sun_path);
}
