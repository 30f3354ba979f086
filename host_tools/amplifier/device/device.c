/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/device.h"
#include "amplifier/device/device_state.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/parking.h"
#include "amplifier/device/register_words.h"
#include "amplifier/device/restart.h"
#include "amplifier/device/sample_number.h"
#include "loop/capture.h"
#include "loop/telemetry.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* Longest and shortest part of a block that is written at once. Multiples of 4, not to cut a breakpoint in two. */
#define WRITE_MOST  (MODBUS_MAX_WRITE_REGISTERS / 4 * 4)
#define WRITE_LEAST 8

static bool is_start(const request_t *request) {
    return request->write != NULL && request->address == ADDRESS_command && request->write[0] == COMMAND_START;
}

/* What an amplifier refuses that has parked or restarted says of it only what it lacks. */
static line_outcome_t transfer(device_t *device, const request_t *request, int tries, failure_t *failure) {
    const line_outcome_t outcome = serial_line_request(&device->line, request, tries, NULL, failure);
    if (outcome == LINE_REFUSED) {
        parking_blame(device, is_start(request), failure);
        device_blame_restart(device, failure); /* which is off, too */
    }
    return outcome;
}

static line_outcome_t write_register(device_t *device, int which, int64_t value, int tries, failure_t *failure);

void device_lock(device_t *device) {
    failure_t ignored;
    if (device->unlocked != 0 && !device->keys_stay) {
        device_clean_up_begin(device);
        (void)write_register(device, INDEX_unlock, 0, 1, &ignored);
        device_clean_up_end(device);
    }
    device->unlocked = 0;
}

void device_forget_locks(device_t *device) {
    device->unlocked = 0;
}

void device_stop_when(device_t *device, const volatile sig_atomic_t *stop) {
    device->line.stop = stop;
}

void device_take_turns(device_t *device, device_turn_t *turn, void *context) {
    device->line.turn = turn;
    device->line.turn_context = context;
}

void device_clean_up_begin(device_t *device) {
    device->line.cleaning_up++;
}

void device_clean_up_end(device_t *device) {
    device->line.cleaning_up--;
}

bool device_map_known(const device_t *device) {
    return device->map_known;
}

bool device_expect_known_map(const device_t *device, failure_t *failure) {
    const int64_t abi = device->identity[INDEX_abi];
    return device->map_known ||
           fail(failure, "%s: register map version %" PRId64 " is unknown here (known: %d): upgrade %s",
                device->line.port, abi, REGISTERS_ABI, abi > REGISTERS_ABI ? "hyst" : "the amplifier's firmware");
}

int64_t device_identity(const device_t *device, int which) {
    return device->identity[which];
}

void device_serial(const device_t *device, char text[DEVICE_SERIAL_TEXT]) {
    const int64_t *identity = device->identity;
    const bool known = (identity[INDEX_serial_high] | identity[INDEX_serial_middle] | identity[INDEX_serial_low]) != 0;
    text[0] = '\0';
    if (known) {
        (void)snprintf(text, DEVICE_SERIAL_TEXT, "%08" PRIX32 "%08" PRIX32 "%08" PRIX32,
                       (uint32_t)identity[INDEX_serial_high], (uint32_t)identity[INDEX_serial_middle],
                       (uint32_t)identity[INDEX_serial_low]);
    }
}

void device_text(const device_t *device, char text[DEVICE_TEXT]) {
    const int64_t version = device->identity[INDEX_firmware_version];
    const char *board = board_name(device->identity[INDEX_board]);
    char serial[DEVICE_SERIAL_TEXT];
    device_serial(device, serial);
    (void)snprintf(text, DEVICE_TEXT, "board %s%s%s, firmware %d.%d.%d", board != NULL ? board : "unknown",
                   serial[0] != '\0' ? ", serial number " : "", serial, (int)(version >> 12), (int)(version >> 6 & 63),
                   (int)(version & 63));
}

double device_sample_rate_hz(const device_t *device) {
    return (double)device->identity[INDEX_sample_rate] / 1000.0;
}

#define LEAST_TIMEOUT_MS 1000.0
/* Over the longest gap: the amplifier's clock and this one need not agree, and an emulated one has pauses. */
#define TIMEOUT_RESERVE 1.2

/* Each lost try is a timeout and as long a silence; one more silence follows a try that succeeded after all. */
int64_t device_communication_timeout_ms(const device_t *device) {
    const double longest_gap_s = (2.0 * (REGISTER_TRIES - 1) + 1.0) * device->line.timeout_s;
    return (int64_t)fmin(UINT16_MAX, fmax(LEAST_TIMEOUT_MS, 1000.0 * TIMEOUT_RESERVE * longest_gap_s));
}

unsigned long device_repetitions(const device_t *device) {
    return device->line.repetitions;
}

bool device_read_span(device_t *device, int first, int last, int64_t *value, failure_t *failure) {
    uint16_t words[MODBUS_MAX_READ_REGISTERS];
    char what[REGISTER_SPAN_NAME];
    request_t request = register_words_request(first, last, words);
    register_words_name(first, last, what);
    request.what = what;
    if (transfer(device, &request, REGISTER_TRIES, failure) != LINE_DONE) {
        return false;
    }
    register_words_decode(first, last, words, value);
    if (first == INDEX_sequence && samples_between(device->seen[first], value[first]) >= 0) {
        device->seen[first] = value[first]; /* one that went back stays to be seen by has_restarted */
    }
    return true;
}

bool device_read(device_t *device, int which, int64_t *value, failure_t *failure) {
    int64_t values[REGISTER_COUNT];
    const bool telemetry = which >= INDEX_sequence && which <= INDEX_high_voltage;
    if (!device_read_span(device, telemetry ? INDEX_sequence : which, which, values, failure)) {
        return false;
    }
    *value = values[which];
    return true;
}

bool device_read_telemetry(device_t *device, int64_t value[REGISTER_COUNT], failure_t *failure) {
    return device_read_span(device, INDEX_sequence, INDEX_reference_limited, value, failure);
}

void device_register_range(int which, int64_t *low, int64_t *high) {
    register_words_range(which, low, high);
}

/* A value that does not fit is refused here: the line carries none of it. */
static line_outcome_t write_span(device_t *device, int first, int last, const int64_t *value, int tries,
                                 failure_t *failure) {
    uint16_t words[MODBUS_MAX_WRITE_REGISTERS];
    int count = 0;
    char what[REGISTER_SPAN_NAME];
    for (int i = first; i <= last; i++) {
        if (!register_words_append(i, value[i], words, &count, failure)) {
            return LINE_REFUSED;
        }
    }
    if (first == last) {
        (void)snprintf(what, sizeof what, "%" PRId64 " to register %s", value[first], register_table[first].name);
    } else {
        register_words_name(first, last, what);
    }
    const request_t request = {.what = what, .address = register_table[first].address, .count = count, .write = words};
    return transfer(device, &request, tries, failure);
}

static line_outcome_t write_register(device_t *device, int which, int64_t value, int tries, failure_t *failure) {
    int64_t values[REGISTER_COUNT];
    values[which] = value;
    return write_span(device, which, which, values, tries, failure);
}

bool device_write(device_t *device, int which, int64_t value, failure_t *failure) {
    return write_register(device, which, value, REGISTER_TRIES, failure) == LINE_DONE;
}

bool device_write_span(device_t *device, int first, int last, const int64_t *value, failure_t *failure) {
    return write_span(device, first, last, value, REGISTER_TRIES, failure) == LINE_DONE;
}

/* Who drives with keys that it has written would lose them where this one locks again. */
static bool find_keys(device_t *device, failure_t *failure) {
    int64_t unlocked = 0, state = LOOP_PARKED;
    if (!device_read(device, INDEX_unlocked, &unlocked, failure) ||
        (unlocked != 0 && !device_read(device, INDEX_state, &state, failure))) {
        return false;
    }
    device->keys_stay = unlocked != 0 && state != LOOP_PARKED;
    return true;
}

bool device_unlock(device_t *device, unsigned what, failure_t *failure) {
    static const struct {
        unsigned what;
        int64_t key;
    } keys[] = {{CONTROL_PARAMETERS, CONTROL_KEY_PARAMETERS}, {CONTROL_OUTPUT, CONTROL_KEY_OUTPUT}};
    if ((what & CONTROL_OUTPUT) != 0) {
        device->keys_stay = false; /* it is this one that drives now */
    } else if (device->unlocked == 0 && !find_keys(device, failure)) {
        return false;
    }
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        if ((what & keys[i].what) != 0) {
            if (!device_write(device, INDEX_unlock, keys[i].key, failure)) {
                return false;
            }
            device->unlocked |= keys[i].what;
        }
    }
    return true;
}

void device_when_left_fault(device_t *device, device_left_fault_t *say, void *context) {
    device->left_fault = say;
    device->left_fault_context = context;
}

/* Of the bits of faults_sticky, where the amplifier is in a fault; else 0. A line that fails fails in the next request.
 */
static int64_t tripped(device_t *device) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored;
    const bool in_fault = device_read_telemetry(device, now, &ignored) && now[INDEX_amplifier_state] == AMPLIFIER_FAULT;
    return in_fault && now[INDEX_trip_cause] > 0 ? INT64_C(1) << (now[INDEX_trip_cause] - 1) : 0;
}

bool device_command(device_t *device, control_command_t command, failure_t *failure) {
    const bool leads_out = command == COMMAND_STOP && device->left_fault != NULL && device->map_known;
    const int64_t fault = leads_out ? tripped(device) : 0;
    if (!device_write(device, INDEX_command, (int64_t)command, failure)) {
        return false;
    }
    device->armed = device->armed && command != COMMAND_DISARM;
    if (fault != 0) {
        device->left_fault(device->left_fault_context, fault);
    }
    return true;
}

/* How long a board stands still while it stores, with a reserve. */
#define SAVE_S 2.0

/* Whether a save was done whose answer did not come, now or in vain: what the registers say of the store, before it and
 * now. */
static bool has_saved(const int64_t before[REGISTER_COUNT], const int64_t now[REGISTER_COUNT]) {
    return now[INDEX_store_sequence] != before[INDEX_store_sequence] ||
           now[INDEX_store_state] != before[INDEX_store_state];
}

bool device_save(device_t *device, bool *refused, failure_t *failure) {
    int64_t before[REGISTER_COUNT], now[REGISTER_COUNT];
    const uint16_t word = COMMAND_SAVE;
    const request_t request = {.what = "the command to store the image",
                               .address = ADDRESS_command,
                               .count = 1,
                               .write = &word,
                               .patience_s = SAVE_S};
    *refused = false;
    if (!device_read_span(device, INDEX_store_state, INDEX_store_sequence, before, failure)) {
        return false;
    }
    for (int attempt = 1;; attempt++) {
        failure_t silent;
        const line_outcome_t outcome = transfer(device, &request, 1, failure);
        *refused = outcome == LINE_REFUSED;
        if (outcome != LINE_NO_ANSWER) {
            return outcome == LINE_DONE;
        }
        if (!device_read_span(device, INDEX_store_state, INDEX_store_sequence, now, &silent)) {
            return false;
        }
        if (has_saved(before, now)) {
            return true;
        }
        if (attempt == REGISTER_TRIES) {
            return false;
        }
        device->line.repetitions++;
    }
}

bool device_start(device_t *device, failure_t *failure) {
    for (int attempt = 1;; attempt++) {
        const line_outcome_t outcome = write_register(device, INDEX_command, COMMAND_START, 1, failure);
        if (outcome == LINE_DONE) {
            return true;
        }
        if (outcome != LINE_NO_ANSWER || attempt == REGISTER_TRIES) {
            return false;
        }
        int64_t capture = 0;
        if (!device_read(device, INDEX_capture_state, &capture, failure)) {
            return false;
        }
        if (capture == CAPTURE_RUNNING || capture == CAPTURE_DONE) {
            return true;
        }
        device->line.repetitions++;
    }
}

/* "block capture at 1200", for messages. */
static void describe(int block, size_t offset, char text[100]) {
    size_t i = 0;
    while (i + 1 < register_block_count && register_blocks[i].address != block) {
        i++;
    }
    (void)snprintf(text, 100, "block %s at %zu", register_blocks[i].name, offset);
}

bool device_read_block(device_t *device, int block, size_t offset, size_t count, uint16_t *value, failure_t *failure) {
    for (size_t done = 0; done < count;) {
        const size_t part = count - done < MODBUS_MAX_READ_REGISTERS ? count - done : MODBUS_MAX_READ_REGISTERS;
        char what[100];
        describe(block, offset + done, what);
        uint16_t *const to = value + done;
        const request_t request = {
            .what = what, .address = block + (int)(offset + done), .count = (int)part, .read = to};
        if (transfer(device, &request, REGISTER_TRIES, failure) != LINE_DONE) {
            return false;
        }
        done += part;
    }
    return true;
}

#define MEASURED_REQUESTS 8
/* Of a full line, and of what the measured requests carried, which had turnaround and latency in them. */
#define SHARE_OF_LINE     0.4
#define SHARE_OF_MEASURED 0.7

bool device_registers_per_sample(device_t *device, double *registers, failure_t *failure) {
    uint16_t ignored[MODBUS_MAX_READ_REGISTERS];
    int64_t first, last;
    bool ok = device_read(device, INDEX_sequence, &first, failure);
    for (int i = 0; ok && i < MEASURED_REQUESTS; i++) {
        /* a block that can always be read */
        ok = device_read_block(device, ADDRESS_waveform, 0, MODBUS_MAX_READ_REGISTERS, ignored, failure);
    }
    if (!ok || !device_read(device, INDEX_sequence, &last, failure)) {
        return false;
    }
    const double bytes = 8.0 + 5.0 + 2.0 * MODBUS_MAX_READ_REGISTERS; /* of a request and its answer, ten bits each */
    const double samples_by_baud = device_sample_rate_hz(device) * 10.0 * bytes / (double)device->line.baud;
    const double samples = (double)samples_between(first, last) / (MEASURED_REQUESTS + 1.0);
    *registers = MODBUS_MAX_READ_REGISTERS / fmax(samples_by_baud / SHARE_OF_LINE, samples / SHARE_OF_MEASURED);
    return true;
}

bool device_read_stream(device_t *device, uint32_t from, size_t count, uint16_t *value, failure_t *failure) {
    const uint16_t words[2] = {(uint16_t)(from >> 16), (uint16_t)from};
    const request_t request = {.what = "block stream",
                               .address = ADDRESS_stream,
                               .count = (int)count,
                               .read = value,
                               .write = words,
                               .first_address = ADDRESS_stream_from,
                               .first_count = 2};
    return transfer(device, &request, REGISTER_TRIES, failure) == LINE_DONE;
}

/* After a lost long request come shorter ones: with occasional interference, or an emulator that pauses, they are more
 * likely to arrive complete. */
bool device_write_block(device_t *device, int block, size_t offset, size_t count, const uint16_t *value,
                        failure_t *failure) {
    size_t most = WRITE_MOST;
    for (size_t done = 0; done < count;) {
        const size_t part = count - done < most ? count - done : most;
        const bool shortest = part <= WRITE_LEAST;
        char what[100];
        describe(block, offset + done, what);
        const request_t request = {
            .what = what, .address = block + (int)(offset + done), .count = (int)part, .write = value + done};
        const line_outcome_t outcome = transfer(device, &request, shortest ? REGISTER_TRIES : 1, failure);
        if (outcome == LINE_DONE) {
            done += part;
        } else if (outcome != LINE_NO_ANSWER || shortest) {
            return false;
        } else {
            most = part / 8 * 4 < WRITE_LEAST ? WRITE_LEAST : part / 8 * 4;
            device->line.repetitions++;
        }
    }
    return true;
}
