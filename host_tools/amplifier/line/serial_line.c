/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/line/serial_line.h"
#include "base/stop_signal.h"
#include "registers/control.h"
#include "registers/register_table.h"
#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

void serial_line_settle(serial_line_t *line) {
    const int silence_ms = (int)(line->timeout_s * 1000.0);
    struct pollfd port = {.fd = modbus_get_socket(line->modbus), .events = POLLIN};
    uint8_t dropped[256];
    for (int bursts = 0; bursts < 20 && poll(&port, 1, silence_ms) > 0; bursts++) {
        if ((port.revents & POLLIN) == 0 || read(port.fd, dropped, sizeof dropped) <= 0) {
            break;
        }
    }
    (void)modbus_flush(line->modbus);
}

/* An RS-485 adapter with a local echo returns every request before the answer. A real answer to this probe differs from
 * it in the third byte. */
static bool line_echoes(serial_line_t *line) {
    const uint8_t probe[] = {(uint8_t)line->slave, MODBUS_FC_READ_HOLDING_REGISTERS, 0, 0, 0, 1};
    if (modbus_send_raw_request(line->modbus, probe, sizeof probe) < 0) {
        return false;
    }
    struct pollfd port = {.fd = modbus_get_socket(line->modbus), .events = POLLIN};
    uint8_t heard[sizeof probe];
    size_t count = 0;
    while (count < sizeof heard && poll(&port, 1, (int)(line->timeout_s * 1000.0)) > 0) {
        const ssize_t got = read(port.fd, heard + count, sizeof heard - count);
        if (got <= 0) {
            break;
        }
        count += (size_t)got;
    }
    serial_line_settle(line);
    return count == sizeof heard && memcmp(heard, probe, sizeof probe) == 0;
}

/* The answer may yet come, or come undamaged, when the request is sent again. */
static bool worth_repeating(int error) {
    switch (error) {
    case ETIMEDOUT:
    case ECONNRESET: /* libmodbus: end of file while waiting */
    case EINTR:
    case EAGAIN: /* another program reads from this line, and took what had come */
    case EMBBADCRC:
    case EMBBADDATA:
    case EMBBADEXC:
    case EMBMDATA:
    case EMBBADSLAVE:
    case EMBXACK:
    case EMBXSBUSY:
        return true;
    default:
        return false;
    }
}

static bool is_exception(int error) {
    return error >= EMBXILFUN && error < EMBBADCRC;
}

/* What the amplifier says of a write that it has just refused, where that is a lock. */
static const char *lock_text(serial_line_t *line, const request_t *request, int error) {
    uint16_t why = 0;
    if (request->write == NULL || error != EMBXSFAIL ||
        modbus_read_registers(line->modbus, register_table[INDEX_write_refused].address, 1, &why) != 1) {
        return "";
    }
    return why == WRITE_PARAMETERS_LOCKED ? "; its parameters are locked"
           : why == WRITE_OUTPUT_LOCKED   ? "; its output is locked"
                                          : "";
}

static bool report(serial_line_t *line, const request_t *request, int error, int tries, failure_t *failure) {
    const char *verb = request->read == NULL ? "writing" : "reading";
    if (is_exception(error)) {
        return fail(failure, "%s: the amplifier refuses %s %s: %s (exception %d)%s", line->port, verb, request->what,
                    modbus_strerror(error), error - MODBUS_ENOBASE, lock_text(line, request, error));
    }
    if (error == ETIMEDOUT) {
        return fail(failure, "no answer from %s (slave %lu) after %d tries, %s %s", line->port, line->slave, tries,
                    verb, request->what);
    }
    if (!worth_repeating(error) || error == ECONNRESET) {
        return fail(failure, "%s: the line is gone, %s %s: %s", line->port, verb, request->what, strerror(error));
    }
    if (error == EAGAIN) {
        return fail(failure, "%s: another program takes the answers from this line, %s %s: end that one first",
                    line->port, verb, request->what);
    }
    if (line_echoes(line)) {
        return fail(failure, "%s: the line returns what is sent: switch off the local echo of the RS-485 adapter",
                    line->port);
    }
    return fail(failure, "%s: damaged answers in %d tries, %s %s (last: %s)", line->port, tries, verb, request->what,
                modbus_strerror(error));
}

/* Whether this request may be made. */
static bool may_go_on(serial_line_t *line, failure_t *failure) {
    if (line->cleaning_up > 0) {
        return true;
    }
    if (line->stop != NULL && *line->stop != 0) {
        return fail(failure, "interrupted (%s)", stop_signal_name(*line->stop));
    }
    device_turn_t *const turn = line->turn;
    line->turn = NULL;
    const bool ok = turn == NULL || turn(line->turn_context, failure);
    line->turn = turn;
    return ok;
}

static void set_timeout(modbus_t *modbus, double seconds) {
    const double whole_s = (double)(long)seconds;
    (void)modbus_set_response_timeout(modbus, (uint32_t)whole_s, (uint32_t)((seconds - whole_s) * 1e6));
}

static int exchange(serial_line_t *line, const request_t *request) {
    if (request->write == NULL) {
        return modbus_read_registers(line->modbus, request->address, request->count, request->read);
    }
    if (request->read == NULL) {
        return modbus_write_registers(line->modbus, request->address, request->count, request->write);
    }
    return modbus_write_and_read_registers(line->modbus, request->first_address, request->first_count, request->write,
                                           request->address, request->count, request->read);
}

line_outcome_t serial_line_request(serial_line_t *line, const request_t *request, int tries, bool *silent,
                                   failure_t *failure) {
    int error = 0;
    for (int attempt = 1; attempt <= tries; attempt++) {
        if (!may_go_on(line, failure)) {
            return LINE_INTERRUPTED;
        }
        if (request->patience_s > line->timeout_s) {
            set_timeout(line->modbus, request->patience_s);
        }
        errno = 0;
        const int result = exchange(line, request);
        error = errno;
        set_timeout(line->modbus, line->timeout_s);
        if (result == request->count) {
            if (attempt > 1) {
                serial_line_settle(line);
            }
            return LINE_DONE;
        }
        if (!worth_repeating(error)) {
            break;
        }
        serial_line_settle(line);
        if (attempt < tries) {
            line->repetitions++;
        }
    }
    (void)report(line, request, error, tries, failure);
    if (silent != NULL) {
        *silent = error == ETIMEDOUT;
    }
    return is_exception(error) ? LINE_REFUSED : worth_repeating(error) ? LINE_NO_ANSWER : LINE_GONE;
}

bool serial_line_open(serial_line_t *line, const device_options_t *options, failure_t *failure) {
    *line = (serial_line_t){.lock = open(options->port, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC),
                            .port = copy_text(options->port),
                            .baud = options->baud,
                            .slave = options->slave,
                            .timeout_s = options->timeout_s};
    if (line->lock < 0) {
        return fail(failure, "cannot open %s: %s", options->port, strerror(errno));
    }
    /* Two clients on one line would read each other's answers. Before the terminal is set, which is the other one's. */
    if (flock(line->lock, LOCK_EX | LOCK_NB) != 0) {
        return fail(failure, "%s is in use by another hyst: end that one first", options->port);
    }
    const char parity = (char)toupper((unsigned char)options->parity[0]); /* as libmodbus has it: N, E or O */
    line->modbus = modbus_new_rtu(options->port, (int)options->baud, parity, 8, 1);
    if (line->modbus == NULL) {
        return fail(failure, "%s: %s", options->port, modbus_strerror(errno));
    }
    if (modbus_set_slave(line->modbus, (int)options->slave) != 0 || modbus_connect(line->modbus) != 0) {
        return fail(failure, "cannot open %s: %s", options->port,
                    errno == ENOTTY ? "not a serial port" : strerror(errno));
    }
    set_timeout(line->modbus, options->timeout_s);
    (void)modbus_set_error_recovery(line->modbus, MODBUS_ERROR_RECOVERY_NONE);
    (void)modbus_flush(line->modbus);
    return true;
}

void serial_line_leave_to_parent(const serial_line_t *line) {
    (void)close(modbus_get_socket(line->modbus)); /* modbus_close would give the parent's port its old settings, too */
    (void)close(line->lock);
}

void serial_line_close(serial_line_t *line) {
    if (line->modbus != NULL) {
        modbus_close(line->modbus);
        modbus_free(line->modbus);
    }
    if (line->lock >= 0) {
        (void)close(line->lock);
    }
    free(line->port);
    *line = (serial_line_t){.lock = -1};
}
