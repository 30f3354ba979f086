/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "simulated_device.h"
#include "amplifier.h"
#include "base/monotonic_clock.h"
#include "fake_board.h"
#include "loop/loop.h"
#include "loop/loop_memory.h"
#include "modbus/modbus_server.h"
#include "registers/control.h"
#include "registers/registers.h"
#include "unity.h"
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

/* Samples the loop makes each millisecond: ten times real time, so that tests do not wait. */
#define SAMPLES_PER_MS 100
/* What a busy machine keeps it waiting for longer than this is not made up for: the request that waits meanwhile would
 * wait for that, too, and a machine that is slower than the loop would never come to it. */
#define BEHIND_MOST_S 0.02

static line_control_t *line;
static twin_t *twin; /* NULL: one to one */
static pid_t process = -1;
static int holder = -1;
static char port[64];

/* The length of a request, or 0 while that is not known. Only the functions that the host uses. */
static size_t request_length(const uint8_t *bytes, size_t count) {
    if (count < 2) {
        return 0;
    }
    if (bytes[1] == 23) {
        return count < 11 ? 0 : 13U + bytes[10];
    }
    if (bytes[1] != 16) {
        return 8;
    }
    return count < 7 ? 0 : 9U + bytes[6];
}

static void send_bytes(int file, const uint8_t *bytes, size_t count) {
    for (size_t sent = 0; sent < count;) {
        const ssize_t part = write(file, bytes + sent, count - sent);
        if (part <= 0) {
            _exit(1);
        }
        sent += (size_t)part;
    }
}

static void seal(uint8_t *frame, size_t length) {
    const uint16_t crc = modbus_crc(frame, length - 2);
    frame[length - 2] = (uint8_t)crc;
    frame[length - 1] = (uint8_t)(crc >> 8);
}

/* One sample later the actuator has this position. */
static uint16_t actuate(uint16_t drive_code) {
    if (twin == NULL) {
        return drive_code;
    }
    twin_step(twin, drive_code);
    return twin_position_code(twin);
}

/* The position shows the drive as late as the fake board says of itself. */
static void sample(void) {
    static uint16_t on_the_way[FAKE_LATENCY];
    static bool settled;
    if (!settled) {
        for (int i = 0; i < FAKE_LATENCY; i++) {
            on_the_way[i] = BOARD_CODE_MIDDLE;
        }
        settled = true;
    }
    if (line->sequence != 0) {
        loop.telemetry.sequence = line->sequence - 1U;
        line->sequence = 0;
    }
    const uint16_t position_code = (uint16_t)(actuate(on_the_way[0]) + line->position_offset);
    memmove(on_the_way, on_the_way + 1, sizeof on_the_way - sizeof on_the_way[0]);
    const uint16_t drive = fake_board_sample((hyst_q31_t)((uint32_t)(position_code ^ BOARD_CODE_MIDDLE) << 16));
    on_the_way[FAKE_LATENCY - 1] = drive;
    line->lowest = drive < line->lowest ? drive : line->lowest;
    line->highest = drive > line->highest ? drive : line->highest;
}

/* As a reset, which a master may notice only by what is gone. */
static void restart_when_due(const uint8_t *request) {
    static uint16_t starts = 1;
    const int address = request[2] << 8 | request[3];
    const bool counts = !line->restart_at_capture ||
                        (request[1] != 16 && address >= ADDRESS_capture && address < ADDRESS_capture + LENGTH_capture);
    if (line->restart_after == 0 || !counts || --line->restart_after > 0) {
        return;
    }
    starts = line->supply_goes ? 1 : starts + 1;
    const board_start_t start = {
        .reset_cause = line->supply_goes ? RESET_POWER : RESET_WATCHDOG, .starts = starts, .serial = FAKE_SERIAL};
    fake_board_start_locked(&start);
}

static void run_loop(double *done_s) {
    const int per_ms = line->samples_per_ms > 0 ? line->samples_per_ms : SAMPLES_PER_MS;
    const double now_s = monotonic_s();
    *done_s = now_s - *done_s > BEHIND_MOST_S ? now_s - BEHIND_MOST_S : *done_s;
    const int samples = (int)((now_s - *done_s) * 1000.0 * per_ms);
    *done_s += samples / (1000.0 * per_ms);
    for (int i = 0; i < samples && !line->loop_stands && line->samples_per_request == 0; i++) {
        sample();
    }
}

/* The loop's communication timeout, but by the clock of the host that the test looks at: the loop of this device runs
 * ahead of it. */
static void watch(double silence_s) {
    uint16_t limit_ms = 0;
    registers_read(ADDRESS_watchdog, 1, &limit_ms);
    const bool moving = loop_mode() != HYST_MODE_PARK || loop_conditioning();
    if (limit_ms != 0 && moving && silence_s > limit_ms / 1000.0) {
        loop_set_timeout(1);
        for (int i = 0; i < 2 * SAMPLES_PER_MS; i++) {
            sample();
        }
        loop_set_timeout(0);
    }
}

static line_fault_t present_fault(void) {
    if (line->times == 0) {
        return LINE_GOOD;
    }
    if (line->after > 0) {
        line->after--;
        return LINE_GOOD;
    }
    line->times--;
    return line->fault;
}

static bool is_command(const uint8_t *request, control_command_t command) {
    return request[1] == 16 && request[2] == ADDRESS_command >> 8 && request[3] == (ADDRESS_command & 0xFF) &&
           request[8] == command;
}

static bool loses(const uint8_t *request, line_fault_t fault) {
    if (line->lost_disarms > 0 && is_command(request, COMMAND_DISARM)) {
        line->lost_disarms--;
        return true;
    }
    return fault == LINE_LOSES_REQUEST;
}

static void answer(int file, const uint8_t *request, size_t length) {
    static const uint8_t noise[] = {0x00, 0xFF, 0x5A};
    uint8_t reply[MODBUS_FRAME_MAX + 2];
    size_t reply_length = 0;
    const line_fault_t fault = present_fault();
    line->requests++;
    if (fault == LINE_HANGS_UP) {
        _exit(0);
    }
    if (loses(request, fault)) {
        line->lost++;
        return;
    }
    restart_when_due(request);
    if (fault == LINE_BUSY) {
        reply[0] = request[0];
        reply[1] = request[1] | 0x80U;
        reply[2] = 6;
        seal(reply, 5);
        send_bytes(file, reply, 5);
        return;
    }
    if (modbus_serve(request, length, reply, &reply_length) == MODBUS_FRAME_FOREIGN) {
        return; /* for another address */
    }
    loop_set_timeout(0); /* time runs too fast here for one, and stops and goes with this machine's load */
    if (is_command(request, COMMAND_START)) {
        line->starts++;
    }
    if (is_command(request, COMMAND_SAVE)) {
        line->saves++;
    }
    if (line->park_after > 0 && --line->park_after == 0) {
        loop_set_mode(HYST_MODE_PARK);
    }
    if (line->disarm_after > 0 && --line->disarm_after == 0) {
        loop_disarm();
    }
    if (line->arms_anew && loop_armed()) {
        loop_disarm();
        (void)loop_arm(true);
    }
    /* A commit is in force from the next sample on; the host may ask before the clock has made one. */
    for (int i = 0; i < 1 + line->samples_per_request && !line->loop_stands; i++) {
        sample();
    }
    switch (fault) {
    case LINE_LOSES_ANSWER:
        return;
    case LINE_DELAYS:
        sleep_until(monotonic_s() + line->delay_ms / 1000.0);
        break;
    case LINE_FLIPS_BIT:
        reply[reply_length / 2] ^= 0x10U;
        break;
    case LINE_CUTS:
        reply_length -= 2;
        break;
    case LINE_WRONG_SLAVE:
        reply[0]++;
        seal(reply, reply_length);
        break;
    case LINE_LIES:
        reply[reply_length - 3]++;
        seal(reply, reply_length);
        break;
    case LINE_NOISE_BEFORE:
        send_bytes(file, noise, sizeof noise);
        break;
    case LINE_ECHOES:
        send_bytes(file, request, length);
        break;
    default:
        break;
    }
    send_bytes(file, reply, reply_length);
}

/* The rate that the master has set on the terminal; a pseudo-terminal keeps it, and knows no parity. */
static bool at_our_rate(int file) {
    static const struct {
        speed_t speed;
        uint32_t baud;
    } rates[] = {{B9600, 9600},   {B19200, 19200},   {B38400, 38400},
                 {B57600, 57600}, {B115200, 115200}, {B230400, 230400}};
    struct termios settings;
    for (size_t i = 0; i < sizeof rates / sizeof rates[0] && tcgetattr(file, &settings) == 0; i++) {
        if (rates[i].baud == fake_board.baud) {
            return cfgetospeed(&settings) == rates[i].speed;
        }
    }
    return false;
}

static void serve(int file) {
    uint8_t request[512];
    size_t count = 0;
    double done_s = monotonic_s(), before_s = done_s;
    double silence_s = 0.0; /* since the last request that was served, as far as this process was there to hear one */
    const uint16_t locked = 0;
    fake_board_power_on(0);
    (void)registers_write(ADDRESS_unlock, 1, &locked);
    for (;;) {
        struct pollfd wait = {.fd = file, .events = POLLIN};
        const int ready = poll(&wait, 1, 1);
        const double now_s = monotonic_s();
        silence_s += fmin(now_s - before_s, BEHIND_MOST_S);
        before_s = now_s;
        run_loop(&done_s);
        if (ready <= 0) {
            watch(silence_s);
            continue;
        }
        const ssize_t got = read(file, request + count, sizeof request - count);
        if (got <= 0) {
            _exit(0);
        }
        count += (size_t)got;
        const size_t length = request_length(request, count);
        if (length > 0 && count >= length) {
            const unsigned lost = line->lost;
            if (at_our_rate(file)) {
                answer(file, request, length);
                modbus_server_take_line();
            }
            silence_s = line->lost == lost ? 0.0 : silence_s;
            count = 0;
        }
    }
}

/* Held open here as well, so that the terminal survives while nobody else has it open; and raw from the start. */
static void hold_port(void) {
    struct termios settings;
    holder = open(port, O_RDWR | O_NOCTTY);
    TEST_ASSERT_TRUE(holder >= 0 && tcgetattr(holder, &settings) == 0);
    cfmakeraw(&settings);
    TEST_ASSERT_TRUE(cfsetspeed(&settings, B115200) == 0 && tcsetattr(holder, TCSANOW, &settings) == 0);
}

const char *simulated_device_start(twin_t *actuator) {
    const int file = posix_openpt(O_RDWR | O_NOCTTY);
    TEST_ASSERT_TRUE(file >= 0 && grantpt(file) == 0 && unlockpt(file) == 0);
    (void)strncpy(port, ptsname(file), sizeof port - 1);
    hold_port();
    line = mmap(NULL, sizeof *line, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(line != MAP_FAILED);
    twin = actuator;
    process = fork();
    if (process == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        /* An amplifier has a processor of its own. Without the right to that much of one it takes its turn. */
        (void)setpriority(PRIO_PROCESS, 0, -15);
        (void)close(holder);
        serve(file);
    }
    TEST_ASSERT_TRUE(process > 0);
    (void)close(file);
    return port;
}

line_control_t *simulated_device_line(void) {
    return line;
}

void simulated_device_fault(line_fault_t fault, unsigned after, unsigned times) {
    line->times = 0;
    line->fault = fault;
    line->after = after;
    line->times = times;
}

void simulated_device_pause(bool pause) {
    (void)kill(process, pause ? SIGSTOP : SIGCONT);
}

void simulated_device_stop(void) {
    if (process > 0) {
        (void)kill(process, SIGKILL);
        (void)waitpid(process, NULL, 0);
        process = -1;
        (void)close(holder);
        (void)munmap(line, sizeof *line);
    }
}
