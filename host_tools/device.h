/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The amplifier at the other end of a serial line: Modbus RTU client.
 *
 * Registers are named by their index in the table that the firmware is made from (register_table.h): the register
 * `mode` is INDEX_mode. A value is the register's integer: an unsigned count, an enumeration or a signed fraction
 * (Q31). Units are the caller's affair (compile.h has the conversions).
 *
 * Requests that get no answer or a damaged one are repeated. Before a repetition the line must have been silent for one
 * timeout, and once more after one that succeeded: an answer that comes late would otherwise be taken for the answer to
 * the next request, because Modbus RTU does not number them. Everything else fails at once with one line.
 */
#ifndef DEVICE_H
#define DEVICE_H

#include "command.h"
#include "control.h"
#include "failure.h"
#include "register_table.h"
#include <stdint.h>

typedef struct {
    const char *port;
    unsigned long baud;
    unsigned long slave;
    double timeout_s; /**< to wait for an answer */
} device_options_t;

#define DEVICE_OPTIONS_DEFAULT                                                                                         \
    { .port = NULL, .baud = 115200, .slave = 1, .timeout_s = 0.5 }

/** Lines of an option_t table that fill a device_options_t. */
#define DEVICE_OPTIONS(options)                                                                                        \
    {"--port", "-p", OPTION_TEXT, "DEV", "serial port of the amplifier, for example /dev/ttyUSB0", &(options).port},   \
        {"--baud", NULL, OPTION_COUNT, "N", "bits per second, 8N1 (115200)", &(options).baud},                         \
        {"--slave", NULL, OPTION_COUNT, "N", "Modbus address (1)", &(options).slave}, {                                \
        "--timeout", NULL, OPTION_NUMBER, "S", "wait for each answer (0.5 s, tried three times)", &(options).timeout_s \
    }

typedef struct device device_t;

/**
 * options_parse for a command with exactly `arguments` positional arguments, whose option table fills *line; checks the
 * line's options too.
 */
int device_options_parse(const command_t *command, const option_t *options, size_t count, int argc, char **argv,
                         size_t arguments, const device_options_t *line);

/** Connects, takes the port for itself, and checks that an amplifier with a register map known here answers. NULL on
 * failure. */
device_t *device_open(const device_options_t *options, failure_t *failure);
/** NULL is allowed. */
void device_close(device_t *device);

/** Value of an identity register (`magic` to `waveform_capacity`), as read when the device was opened. */
int64_t device_identity(const device_t *device, int which);
/** Samples per second of the loop. */
double device_sample_rate_hz(const device_t *device);
/** Registers per second that can be read while the line is good. Careful: full requests take 40 % of the time of the
 * line; the rest is for turning it round, for a USB adapter that collects for 16 ms, and for other requests. */
double device_registers_per_s(const device_t *device);

/** The present value; of a telemetry register that of a new snapshot. */
bool device_read(device_t *device, int which, int64_t *value, failure_t *failure);

/**
 * Reads the registers first..last, which must have neighbouring addresses, in one request, so that they belong
 * together. value has REGISTER_COUNT elements; those of first..last are written. Telemetry registers show the snapshot
 * that was taken when `sequence` was last read.
 */
bool device_read_span(device_t *device, int first, int last, int64_t *value, failure_t *failure);

/** One telemetry snapshot: the registers `sequence` to `frames_served` of one sample. */
bool device_read_telemetry(device_t *device, int64_t value[REGISTER_COUNT], failure_t *failure);

bool device_write(device_t *device, int which, int64_t value, failure_t *failure);

/** A command, repeated when its answer is lost: not for `start`, which would begin anew. */
bool device_command(device_t *device, control_command_t command, failure_t *failure);

/** Starts the source. A lost answer is settled by looking whether the armed capture has begun, not by starting again.
 */
bool device_start(device_t *device, failure_t *failure);

/** `count` registers of the block at the address `block` (ADDRESS_capture ...), from its register `offset` on, in as
 * many requests as it takes. */
bool device_read_block(device_t *device, int block, size_t offset, size_t count, uint16_t *value, failure_t *failure);
bool device_write_block(device_t *device, int block, size_t offset, size_t count, const uint16_t *value,
                        failure_t *failure);

/** Requests that had to be repeated since the device was opened. */
unsigned long device_repetitions(const device_t *device);

#endif
