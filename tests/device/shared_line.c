/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "shared_line.h"
#include "amplifier.h"
#include "base/monotonic_clock.h"
#include "fake_board.h"
#include "modbus/modbus_server.h"
#include "unity.h"
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

enum { BURST_MAX = 512, QUIET_MS = 4, SAMPLES_A_BURST = 200, NOBODY = 100 };

static char port[64];
static int holder = -1;
static pid_t processes[SHARED_LINE_MAX + 1U]; /* the amplifiers, and the line itself */
static unsigned started;
static shared_line_node_t *nodes;

/* In the process of one amplifier. */
static struct {
    int line;
    shared_line_node_t *node;
} self;

static void put(const uint8_t *bytes, size_t length) {
    if (send(self.line, bytes, length, MSG_NOSIGNAL) != (ssize_t)length) {
        _exit(0);
    }
}

static void answered(const uint8_t *frame, size_t length) {
    uint8_t bytes[MODBUS_FRAME_MAX];
    memcpy(bytes, frame, length);
    switch (self.node->answers) {
    case ANSWERS_NOT:
        return;
    case ANSWERS_LATE:
        sleep_until(monotonic_s() + self.node->delay_ms / 1000.0);
        break;
    case ANSWERS_GARBLED:
        bytes[length / 2U] ^= 0x10U;
        break;
    case ANSWERS_CUT:
        length -= 3U;
        break;
    case ANSWERS_AS_NOBODY: {
        bytes[0] = NOBODY;
        const uint16_t crc = modbus_crc(bytes, length - 2U);
        bytes[length - 2U] = (uint8_t)crc;
        bytes[length - 1U] = (uint8_t)(crc >> 8);
        break;
    }
    case ANSWERS_TWICE:
        put(bytes, length);
        break;
    case ANSWERS_RIGHT:
        break;
    }
    self.node->sent++; /* before anybody can have it */
    put(bytes, length);
}

static void be_silent(void) {
    fake_board.microseconds += 3U * FAKE_SILENCE_US;
}

static void live(uint8_t address) {
    const line_settings_t settings = {.address = address, .baud = 115200, .parity = LINE_PARITY_NONE};
    fake_board_power_on(0);
    modbus_server_change_line(&settings);
    modbus_server_take_line();
    fake_board_sends = answered;
    for (;;) {
        uint8_t burst[BURST_MAX];
        const ssize_t length = recv(self.line, burst, sizeof burst, 0);
        if (length <= 0) {
            _exit(0);
        }
        be_silent();
        for (ssize_t i = 0; i < length; i++) {
            modbus_server_receive(burst[i]);
        }
        be_silent();
        (void)amplifier_serve();
        (void)fake_board_run(SAMPLES_A_BURST);
    }
}

static void to_all_but(const int lines[], unsigned count, unsigned but, const uint8_t *burst, size_t length) {
    for (unsigned i = 0; i < count; i++) {
        if (i != but && send(lines[i], burst, length, MSG_NOSIGNAL) != (ssize_t)length) {
            _exit(0);
        }
    }
}

static bool ready(int file, int wait_ms) {
    struct pollfd look = {.fd = file, .events = POLLIN};
    return poll(&look, 1, wait_ms) > 0;
}

/* What the master has sent until it pauses. */
static size_t burst_of_master(int terminal, uint8_t burst[BURST_MAX]) {
    size_t length = 0;
    do {
        const ssize_t got = read(terminal, burst + length, BURST_MAX - length);
        if (got <= 0) {
            _exit(0);
        }
        length += (size_t)got;
    } while (length < BURST_MAX && ready(terminal, QUIET_MS));
    return length;
}

/* The two wires. */
static void carry(int terminal, const int lines[], unsigned count) {
    for (;;) {
        uint8_t burst[BURST_MAX];
        struct pollfd look[SHARED_LINE_MAX + 1U] = {{.fd = terminal, .events = POLLIN}};
        for (unsigned i = 0; i < count; i++) {
            look[i + 1U] = (struct pollfd){.fd = lines[i], .events = POLLIN};
        }
        if (poll(look, count + 1U, -1) < 0) {
            _exit(0);
        }
        for (unsigned i = 0; i < count; i++) {
            if (look[i + 1U].revents != 0) {
                const ssize_t length = recv(lines[i], burst, sizeof burst, 0);
                if (length <= 0 || write(terminal, burst, (size_t)length) != length) {
                    _exit(0);
                }
                to_all_but(lines, count, i, burst, (size_t)length);
            }
        }
        if (look[0].revents != 0) {
            const size_t length = burst_of_master(terminal, burst);
            to_all_but(lines, count, count, burst, length);
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

static pid_t start_process(void) {
    const pid_t process = fork();
    TEST_ASSERT_TRUE(process >= 0);
    if (process == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        (void)close(holder);
    }
    return process;
}

const char *shared_line_start(const uint8_t *addresses, unsigned count) {
    int lines[SHARED_LINE_MAX];
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    TEST_ASSERT_TRUE(count <= SHARED_LINE_MAX && terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
    (void)strncpy(port, ptsname(terminal), sizeof port - 1);
    hold_port();
    nodes = mmap(NULL, SHARED_LINE_MAX * sizeof *nodes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(nodes != MAP_FAILED);
    started = 0;
    for (unsigned i = 0; i < count; i++) {
        int pair[2];
        TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_SEQPACKET, 0, pair));
        processes[started] = start_process();
        if (processes[started] == 0) {
            (void)close(terminal);
            (void)close(pair[0]);
            self.line = pair[1];
            self.node = &nodes[i];
            live(addresses[i]);
        }
        started++;
        (void)close(pair[1]);
        lines[i] = pair[0];
    }
    processes[started] = start_process();
    if (processes[started] == 0) {
        carry(terminal, lines, count);
    }
    started++;
    (void)close(terminal);
    for (unsigned i = 0; i < count; i++) {
        (void)close(lines[i]);
    }
    return port;
}

shared_line_node_t *shared_line_node(unsigned which) {
    return &nodes[which];
}

void shared_line_stop(void) {
    for (; started > 0; started--) {
        (void)kill(processes[started - 1U], SIGKILL);
        (void)waitpid(processes[started - 1U], NULL, 0);
    }
    if (holder >= 0) {
        (void)close(holder);
        holder = -1;
        (void)munmap(nodes, SHARED_LINE_MAX * sizeof *nodes);
    }
}
