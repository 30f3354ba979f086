/* SPDX-License-Identifier: MIT */
#include "wire.h"
#include "fake_board.h"
#include "master.h"
#include "registers/control.h"
#include "unity.h"
#include <string.h>

#define WAITING_MAX 64U

typedef struct {
    uint8_t bytes[MODBUS_FRAME_MAX];
    size_t length;
} waiting_t;

wire_t wire;

/* The frame that goes over the line, and those that the server has not shown to have read. */
static struct {
    uint8_t bytes[MODBUS_FRAME_MAX];
    size_t length;
    bool broken;
    uint32_t last_time;
    bool echoes;           /* are made */
    bool echoed, collided; /* since the last silence */
    waiting_t waiting[WAITING_MAX];
    unsigned count;
} line;

static uint32_t command_of(const waiting_t *request) {
    return master_command_of(request->bytes + 1, request->length - 3U);
}

static void take(const waiting_t *request, bool certain) {
    const uint32_t command = command_of(request);
    if (command != COMMAND_NONE) {
        TEST_ASSERT_LESS_THAN_UINT(WIRE_COMMANDS_MAX, wire.count);
        wire.certain[wire.count] = certain;
        wire.command[wire.count++] = command;
    }
}

/* A broadcast has been read by now. What writes the command and nothing else was taken, if it is one that makes the
 * output safer; of a longer one that is not known. Anything else never is. */
static void broadcast_was_read(const waiting_t *request) {
    const uint8_t function = request->bytes[1];
    const uint32_t command = command_of(request);
    if (function != 5 && function != 6 && function != 15 && function != 16 && function != 22) {
        return;
    }
    wire.maybe_heard = true;
    if (command == COMMAND_STOP || command == COMMAND_DISARM || command == COMMAND_PARK) {
        take(request, function != 16 && request->length - 3U == (function == 22 ? 7U : function == 15 ? 7U : 5U));
    }
}

static void drop(unsigned count) {
    line.count -= count;
    memmove(line.waiting, line.waiting + count, line.count * sizeof line.waiting[0]);
}

/* Into a frame that has begun meanwhile: then both are lost, and what follows without a silence. So are two echoes that
 * come at once. */
static void echo(const uint8_t *frame, size_t length) {
    if (line.echoes) {
        line.collided = line.length > 0 || (line.echoed && fake_board.microseconds == line.last_time);
        line.broken = line.broken || line.length > 0;
        line.echoed = true;
        line.last_time = fake_board.microseconds;
        for (size_t byte = 0; byte < length; byte++) {
            modbus_server_receive(frame[byte]);
        }
    }
}

/* Those that were sent before the one that was answered were read before it, or lost. */
static void answered(const uint8_t *frame, size_t length) {
    wire.answers++;
    for (unsigned i = 0; i < line.count; i++) {
        const waiting_t *request = &line.waiting[i];
        if (request->bytes[0] == MODBUS_BROADCAST_ADDRESS) {
            broadcast_was_read(request);
        } else if (request->bytes[0] == frame[0] && request->bytes[1] == (frame[1] & 0x7FU)) {
            if ((frame[1] & 0x80U) == 0) {
                wire.heard = wire.maybe_heard = true;
                wire.accepted++;
                take(request, true);
            }
            drop(i + 1U);
            echo(frame, length);
            return;
        }
    }
    wire.unasked = true;
}

void wire_start(void) {
    memset(&line, 0, sizeof line);
    memset(&wire, 0, sizeof wire);
    fake_board_sends = answered;
}

static void end_frame(void) {
    const bool whole = !line.broken && line.length >= 4U && line.length <= MODBUS_FRAME_MAX &&
                       modbus_crc(line.bytes, line.length) == 0;
    const bool ours = line.bytes[0] == MODBUS_BROADCAST_ADDRESS || line.bytes[0] == modbus_server_address();
    if (whole && ours && line.bytes[1] < 0x80U) {
        if (line.count == WAITING_MAX) {
            drop(1);
        }
        memcpy(line.waiting[line.count].bytes, line.bytes, line.length);
        line.waiting[line.count++].length = line.length;
    }
    line.length = 0;
    line.broken = false;
}

static uint32_t since_the_last_byte(void) {
    return fake_board.microseconds - line.last_time;
}

void wire_settle(void) {
    if (line.length > 0 && since_the_last_byte() > line_silence_us(fake_board.baud)) {
        end_frame();
    }
}

static void put(uint8_t byte, bool broken) {
    if (since_the_last_byte() > line_gap_us(fake_board.baud)) {
        if (line.length > 0) {
            end_frame();
        }
        line.echoed = line.collided = false;
    }
    line.broken = line.broken || line.collided || broken || line.length == MODBUS_FRAME_MAX;
    if (line.length < MODBUS_FRAME_MAX) {
        line.bytes[line.length++] = byte;
    }
    line.last_time = fake_board.microseconds;
}

void wire_byte(uint8_t byte) {
    put(byte, false);
    modbus_server_receive(byte);
}

void wire_broken_byte(void) {
    put(0, true);
    modbus_server_line_error();
}

void wire_echoes(bool on) {
    line.echoes = on;
}

void wire_served(void) {
    for (unsigned i = 0; i < line.count; i++) {
        const waiting_t *request = &line.waiting[i];
        if (request->bytes[0] == MODBUS_BROADCAST_ADDRESS) {
            broadcast_was_read(request);
        } else {
            wire.unanswered = true;
        }
    }
    line.count = 0;
}

bool wire_waits_for(uint32_t command) {
    bool found = false;
    for (unsigned i = 0; i < line.count; i++) {
        found = found || command_of(&line.waiting[i]) == command;
    }
    return found;
}

void wire_forget(void) {
    wire.count = 0;
    wire.heard = wire.maybe_heard = wire.unasked = wire.unanswered = false;
}
