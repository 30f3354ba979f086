/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device.h"
#include "amplifier/line_search.h"
#include "amplifier/mode_names.h"
#include "amplifier/sample_number.h"
#include "base/monotonic_clock.h"
#include "base/provenance.h"
#include "loop/capture.h"
#include "loop/telemetry.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRIES 3
/* A loop without a sample for this long counts as stopped. */
#define STANDSTILL_S 5.0
/* A ramp over the whole range takes a board at most 10 s (hyst/board_limits.h). */
#define PARKED_S 12.0
/* Longest and shortest part of a block that is written at once. Multiples of 4, not to cut a breakpoint in two. */
#define WRITE_MOST  (MODBUS_MAX_WRITE_REGISTERS / 4 * 4)
#define WRITE_LEAST 8

struct device {
    serial_line_t line;
    int64_t identity[REGISTER_COUNT]; /* magic to serial_low are filled */
    bool map_known;                   /* otherwise identity has magic and abi alone */
    unsigned unlocked;                /* by device_unlock */
    bool keys_stay;                   /* another master drives with keys that it has written */
    int64_t seen[REGISTER_COUNT];     /* starts, events and sequence, as last read: the last two only grow in a start */
    bool starts_known;
    device_left_fault_t *left_fault; /* or NULL; see device_when_left_fault */
    void *left_fault_context;
};

static int64_t decode(register_type_t type, const uint16_t *words) {
    if (REGISTER_SIZE(type) == 1) {
        return words[0];
    }
    const uint32_t whole = ((uint32_t)words[0] << 16) | words[1];
    return type == REGISTER_U32 ? (int64_t)whole : (int64_t)(int32_t)whole;
}

static request_t read_request(int first, int last, uint16_t *words) {
    const int start = register_table[first].address;
    const int end = register_table[last].address + (int)REGISTER_SIZE(register_table[last].type);
    return (request_t){.what = register_table[first].name, .address = start, .count = end - start, .read = words};
}

static void decode_span(int first, int last, const uint16_t *words, int64_t *value) {
    for (int i = first; i <= last; i++) {
        value[i] = decode(register_table[i].type, words + (register_table[i].address - register_table[first].address));
    }
}

enum { SPAN_NAME = 100 };

static void name_span(int first, int last, char what[SPAN_NAME]) {
    if (first == last) {
        (void)snprintf(what, SPAN_NAME, "register %s", register_table[first].name);
    } else {
        (void)snprintf(what, SPAN_NAME, "registers %s to %s", register_table[first].name, register_table[last].name);
    }
}

static line_outcome_t transfer(device_t *device, const request_t *request, int tries, failure_t *failure) {
    const line_outcome_t outcome = serial_line_request(&device->line, request, tries, NULL, failure);
    if (outcome == LINE_REFUSED) { /* what an amplifier refuses that has restarted says of it only what it lacks */
        device_blame_restart(device, failure);
    }
    return outcome;
}

/* An earlier client may have ended while it waited, and its late answer could be read here. An unexpected value is
 * therefore read again once the line is silent. */
static line_outcome_t read_expected(device_t *device, int which, uint16_t expected, uint16_t *value, bool *silent,
                                    failure_t *failure) {
    char what[100];
    (void)snprintf(what, sizeof what, "register %s", register_table[which].name);
    const request_t request = {.what = what, .address = register_table[which].address, .count = 1, .read = value};
    const line_outcome_t outcome = serial_line_request(&device->line, &request, TRIES, silent, failure);
    if (outcome != LINE_DONE || *value == expected) {
        return outcome;
    }
    serial_line_settle(&device->line);
    return serial_line_request(&device->line, &request, TRIES, silent, failure);
}

/* silent: set when the first request had no answer at all. */
static bool check_magic(device_t *device, bool *silent, failure_t *failure) {
    uint16_t magic = 0;
    switch (read_expected(device, INDEX_magic, REGISTERS_MAGIC, &magic, silent, failure)) {
    case LINE_DONE:
        break;
    case LINE_REFUSED:
        return fail_in(failure, "%s is not a hyst amplifier", device->line.port);
    default:
        return false;
    }
    device->identity[INDEX_magic] = magic;
    return magic == REGISTERS_MAGIC || fail(failure, "%s is not a hyst amplifier: register magic is 0x%04X, not 0x%04X",
                                            device->line.port, (unsigned)magic, (unsigned)REGISTERS_MAGIC);
}

bool device_expect_known_map(const device_t *device, failure_t *failure) {
    const int64_t abi = device->identity[INDEX_abi];
    return device->map_known ||
           fail(failure, "%s: register map version %" PRId64 " is unknown here (known: %d): upgrade %s",
                device->line.port, abi, REGISTERS_ABI, abi > REGISTERS_ABI ? "hyst" : "the amplifier's firmware");
}

/* Only magic, abi and what makes safe mean the same in every version of the map (registers.def). */
static bool check_identity(device_t *device, bool any_map, bool *silent, failure_t *failure) {
    uint16_t abi = 0;
    if (!check_magic(device, silent, failure) ||
        read_expected(device, INDEX_abi, REGISTERS_ABI, &abi, NULL, failure) != LINE_DONE) {
        return false;
    }
    device->identity[INDEX_abi] = abi;
    device->map_known = abi == REGISTERS_ABI;
    if (!device->map_known && any_map) {
        return true;
    }
    return device_expect_known_map(device, failure) &&
           device_read_span(device, INDEX_magic, INDEX_serial_low, device->identity, failure);
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

/* For what results say of their origin. */
static void note_device(const device_t *device) {
    char text[DEVICE_TEXT + 300], itself[DEVICE_TEXT];
    device_text(device, itself);
    (void)snprintf(text, sizeof text, "%s, at %s, address %lu", itself, device->line.port, device->line.slave);
    provenance_set_device(text);
}

/* Adds to the line that there was no answer where there is one. */
static void say_where(const device_options_t *options, failure_t *failure) {
    const failure_t silence = *failure;
    device_options_t found;
    if (line_search(options, &found)) {
        (void)fail(failure,
                   "%.400s, at %lu baud, parity %s. An amplifier answers with --baud %lu --parity %s --slave %lu",
                   silence.text, options->baud, options->parity, found.baud, found.parity, found.slave);
    } else {
        (void)fail(failure, "%.400s, at %lu baud, parity %s, nor at another rate or parity", silence.text,
                   options->baud, options->parity);
    }
}

static device_t *open_device(const device_options_t *options, bool any_map, failure_t *failure) {
    device_t *device = allocate(1, sizeof *device);
    bool silent = false;
    if (!serial_line_open(&device->line, options, failure) || !check_identity(device, any_map, &silent, failure)) {
        device_close(device);
        if (silent && options->look_elsewhere) {
            say_where(options, failure);
        }
        return NULL;
    }
    if (device->map_known) {
        note_device(device);
        device_note_start(device);
    }
    return device;
}

device_t *device_open(const device_options_t *options, failure_t *failure) {
    return open_device(options, false, failure);
}

device_t *device_open_any_map(const device_options_t *options, failure_t *failure) {
    return open_device(options, true, failure);
}

bool device_map_known(const device_t *device) {
    return device->map_known;
}

/* Not by transfer, which asks for it. Older firmware refuses it. */
static bool read_span_once(device_t *device, int first, int last, int64_t *value, failure_t *failure) {
    uint16_t words[MODBUS_MAX_READ_REGISTERS];
    const request_t request = read_request(first, last, words);
    if (serial_line_request(&device->line, &request, TRIES, NULL, failure) != LINE_DONE) {
        return false;
    }
    decode_span(first, last, words, value);
    return true;
}

static bool read_start(device_t *device, int64_t now[REGISTER_COUNT], failure_t *failure) {
    return read_span_once(device, INDEX_sequence, INDEX_sequence, now, failure) &&
           read_span_once(device, INDEX_reset_cause, INDEX_events, now, failure);
}

static void keep_start(device_t *device, const int64_t now[REGISTER_COUNT]) {
    device->seen[INDEX_starts] = now[INDEX_starts];
    device->seen[INDEX_events] = now[INDEX_events];
    device->seen[INDEX_sequence] = now[INDEX_sequence];
    device->starts_known = true;
}

void device_note_start(device_t *device) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored; /* a line that fails fails in the next request */
    if (read_start(device, now, &ignored)) {
        keep_start(device, now);
    }
}

/* The count of starts begins anew with the supply, so it alone does not tell. Says so once. */
static bool has_restarted(device_t *device, const int64_t now[REGISTER_COUNT]) {
    const int64_t *const seen = device->seen;
    const bool restarted = now[INDEX_starts] != seen[INDEX_starts] || now[INDEX_events] < seen[INDEX_events] ||
                           samples_between(seen[INDEX_sequence], now[INDEX_sequence]) < 0;
    keep_start(device, now);
    return restarted;
}

static bool say_restart(failure_t *failure) {
    return fail(failure, "the amplifier restarted: what was set in it and not stored is gone");
}

bool device_check_start(device_t *device, failure_t *failure) {
    int64_t now[REGISTER_COUNT];
    return !device->starts_known ||
           (read_start(device, now, failure) && (!has_restarted(device, now) || say_restart(failure)));
}

void device_blame_restart(device_t *device, failure_t *failure) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored;
    if (device->starts_known && read_start(device, now, &ignored) && has_restarted(device, now)) {
        (void)say_restart(failure);
    }
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

void device_close(device_t *device) {
    if (device == NULL) {
        return;
    }
    device_lock(device);
    serial_line_close(&device->line);
    free(device);
}

void device_leave_to_parent(const device_t *device) {
    serial_line_leave_to_parent(&device->line);
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

int64_t device_identity(const device_t *device, int which) {
    return device->identity[which];
}

double device_sample_rate_hz(const device_t *device) {
    return (double)device->identity[INDEX_sample_rate] / 1000.0;
}

#define LEAST_TIMEOUT_MS 1000.0
/* Over the longest gap: the amplifier's clock and this one need not agree, and an emulated one has pauses. */
#define TIMEOUT_RESERVE 1.2

/* Each lost try is a timeout and as long a silence; one more silence follows a try that succeeded after all. */
int64_t device_communication_timeout_ms(const device_t *device) {
    const double longest_gap_s = (2.0 * (TRIES - 1) + 1.0) * device->line.timeout_s;
    return (int64_t)fmin(UINT16_MAX, fmax(LEAST_TIMEOUT_MS, 1000.0 * TIMEOUT_RESERVE * longest_gap_s));
}

unsigned long device_repetitions(const device_t *device) {
    return device->line.repetitions;
}

bool device_read_span(device_t *device, int first, int last, int64_t *value, failure_t *failure) {
    uint16_t words[MODBUS_MAX_READ_REGISTERS];
    char what[SPAN_NAME];
    request_t request = read_request(first, last, words);
    name_span(first, last, what);
    request.what = what;
    if (transfer(device, &request, TRIES, failure) != LINE_DONE) {
        return false;
    }
    decode_span(first, last, words, value);
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
    const register_type_t type = register_table[which].type;
    const bool is_signed = REGISTER_SIZE(type) == 2 && type != REGISTER_U32;
    *low = is_signed ? INT32_MIN : 0;
    *high = is_signed ? INT32_MAX : REGISTER_SIZE(type) == 2 ? UINT32_MAX : UINT16_MAX;
}

/* Appends the registers of a value to the words of a request. */
static bool encode(int which, int64_t value, uint16_t *words, int *count, failure_t *failure) {
    const uint32_t whole = (uint32_t)value;
    int64_t low, high;
    device_register_range(which, &low, &high);
    if (value < low || value > high) {
        return fail(failure, "register %s takes %" PRId64 " to %" PRId64 ", not %" PRId64, register_table[which].name,
                    low, high, value);
    }
    if (REGISTER_SIZE(register_table[which].type) == 2) {
        words[(*count)++] = (uint16_t)(whole >> 16);
    }
    words[(*count)++] = (uint16_t)whole;
    return true;
}

/* A value that does not fit is refused here: the line carries none of it. */
static line_outcome_t write_span(device_t *device, int first, int last, const int64_t *value, int tries,
                                 failure_t *failure) {
    uint16_t words[MODBUS_MAX_WRITE_REGISTERS];
    int count = 0;
    char what[SPAN_NAME];
    for (int i = first; i <= last; i++) {
        if (!encode(i, value[i], words, &count, failure)) {
            return LINE_REFUSED;
        }
    }
    if (first == last) {
        (void)snprintf(what, sizeof what, "%" PRId64 " to register %s", value[first], register_table[first].name);
    } else {
        name_span(first, last, what);
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
    return write_register(device, which, value, TRIES, failure) == LINE_DONE;
}

bool device_write_span(device_t *device, int first, int last, const int64_t *value, failure_t *failure) {
    return write_span(device, first, last, value, TRIES, failure) == LINE_DONE;
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
        if (attempt == TRIES) {
            return false;
        }
        device->line.repetitions++;
    }
}

bool device_expect_off(device_t *device, const char *what, failure_t *failure) {
    const double until_s = monotonic_s() + PARKED_S;
    int64_t state = AMPLIFIER_STOP;
    bool read = device_read(device, INDEX_amplifier_state, &state, failure);
    while (read && state == AMPLIFIER_STOP && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + 0.02);
        read = device_read(device, INDEX_amplifier_state, &state, failure);
    }
    return read &&
           (state == AMPLIFIER_OFF ||
            fail(failure, "the amplifier is on, and stores %s only while it is off: disarm it (command 10)", what));
}

/* Precharge waits for the end of a ramp, and then for its self test, 1 s at most, in the loop's time (REGISTERS). */
#define PRECHARGE_S (PARKED_S + 1.0)

/* From STOP on, which leads out of a fault. */
static bool command_arm(device_t *device, failure_t *failure) {
    return device_command(device, COMMAND_STOP, failure) &&
           device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, failure) &&
           device_write(device, INDEX_watchdog, device_communication_timeout_ms(device), failure) &&
           (device_command(device, COMMAND_ARM, failure) ||
            fail_in(failure, "the amplifier cannot be armed: was an image pushed since it started?"));
}

/* What a sample after the arming says: that it cannot come to its end any more. */
static bool check_arming(device_t *device, const int64_t now[REGISTER_COUNT], failure_t *failure) {
    const int64_t power = now[INDEX_amplifier_state];
    char faults[FAULTS_TEXT];
    if (power == AMPLIFIER_FAULT) {
        return fail(failure, "%s: the amplifier trips as soon as it is armed: %s", device->line.port,
                    faults_text(now[INDEX_faults_live], faults));
    }
    return (power != AMPLIFIER_OFF && power != AMPLIFIER_STOP) ||
           (device_check_start(device, failure) &&
            fail(failure, "%s: somebody else has switched the amplifier off while it was armed here",
                 device->line.port));
}

static bool say_standstill(const device_t *device, int64_t sample, failure_t *failure) {
    return fail(failure,
                "%s: the amplifier's loop stands still at sample %" PRId64 ": do its converters, or its twin, run?",
                device->line.port, sample);
}

bool device_arm(device_t *device, failure_t *failure) {
    int64_t now[REGISTER_COUNT], first;
    /* Telemetry is of the newest sample, which may be older than the command: only what a later one says counts. */
    if (!command_arm(device, failure) || !device_read(device, INDEX_sequence, &first, failure)) {
        return false;
    }
    const double most = PRECHARGE_S * device_sample_rate_hz(device);
    int64_t sample = first;
    for (double until_s = monotonic_s() + STANDSTILL_S; (double)samples_between(first, sample) < most;) {
        sleep_until(monotonic_s() + 0.02);
        if (!device_read_span(device, INDEX_sequence, INDEX_amplifier_state, now, failure)) {
            return false;
        }
        if (now[INDEX_sequence] == sample) {
            if (monotonic_s() > until_s) {
                return say_standstill(device, sample, failure);
            }
            continue;
        }
        if (!check_arming(device, now, failure)) {
            return false;
        }
        if (now[INDEX_amplifier_state] != AMPLIFIER_PRECHARGE) {
            return true;
        }
        sample = now[INDEX_sequence];
        until_s = monotonic_s() + STANDSTILL_S;
    }
    return fail(failure,
                "%s: the amplifier is still in precharge after %g s of its time: does somebody else arm it anew?",
                device->line.port, PRECHARGE_S);
}

bool device_start(device_t *device, failure_t *failure) {
    for (int attempt = 1;; attempt++) {
        const line_outcome_t outcome = write_register(device, INDEX_command, COMMAND_START, 1, failure);
        if (outcome == LINE_DONE) {
            return true;
        }
        if (outcome != LINE_NO_ANSWER || attempt == TRIES) {
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
        if (transfer(device, &request, TRIES, failure) != LINE_DONE) {
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
    return transfer(device, &request, TRIES, failure) == LINE_DONE;
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
        const line_outcome_t outcome = transfer(device, &request, shortest ? TRIES : 1, failure);
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
