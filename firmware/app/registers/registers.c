/* SPDX-License-Identifier: MIT */
#include "registers/registers.h"
#include "registers/control.h"
#include "registers/register_blocks.h"
#include "registers/register_table.h"
#include <stdbool.h>
#include <string.h>

typedef struct {
    uint16_t address;
    uint8_t registers;
    uint8_t access;
} entry_t;

static const entry_t entries[REGISTER_COUNT] = {
#define REGISTER(name, address, type, access, unit, text) {address, REGISTER_SIZE(REGISTER_##type), REGISTER_##access},
#include "registers/registers.def"
};

/* Every register's value, whatever its type, in the order of the table. */
static uint32_t value[REGISTER_COUNT];

/* A run of registers, from `first` up to but not including `end`. */
typedef struct {
    uint32_t first, end;
} span_t;

static bool covers(span_t span, uint32_t address) {
    return address >= span.first && address < span.end;
}

/* The entry that a register belongs to, or REGISTER_COUNT. */
static unsigned find(uint32_t address) {
    unsigned i = 0;
    while (i < REGISTER_COUNT && address >= (uint32_t)entries[i].address + entries[i].registers) {
        i++;
    }
    return i < REGISTER_COUNT && address >= entries[i].address ? i : REGISTER_COUNT;
}

static uint16_t half(uint32_t x, bool low) {
    return (uint16_t)(low ? x : x >> 16);
}

void registers_init(const board_start_t *start, const line_settings_t *line) {
    memset(value, 0, sizeof value);
    register_blocks_init();
    control_init(value, start, line);
    control_latch(value);
}

modbus_exception_t registers_check_read(uint16_t address, uint16_t count) {
    const span_t span = {address, (uint32_t)address + count};
    if (register_blocks_hold(address, count)) {
        return register_blocks_check_read(address);
    }
    for (uint32_t at = span.first; at < span.end; at++) {
        if (find(at) == REGISTER_COUNT) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
    }
    return MODBUS_OK;
}

void registers_read(uint16_t address, uint16_t count, uint16_t values[]) {
    const span_t span = {address, (uint32_t)address + count};
    if (register_blocks_hold(address, count)) {
        register_blocks_read(address, count, values);
        return;
    }
    if (covers(span, ADDRESS_sequence)) {
        control_latch(value);
    }
    control_refresh(value);
    for (uint32_t at = span.first; at < span.end; at++) {
        const unsigned i = find(at);
        values[at - span.first] = half(value[i], at == entries[i].address + entries[i].registers - 1U);
    }
}

static modbus_exception_t refuse(write_refusal_t refusal, uint32_t address, modbus_exception_t exception) {
    value[INDEX_write_refused] = refusal;
    value[INDEX_write_refused_at] = address;
    return exception;
}

/* Whether what a write needs is unlocked. */
static modbus_exception_t check_lock(uint32_t needs, uint32_t address) {
    if ((needs & ~value[INDEX_unlocked]) == 0) {
        return MODBUS_OK;
    }
    return refuse(needs == CONTROL_OUTPUT ? WRITE_OUTPUT_LOCKED : WRITE_PARAMETERS_LOCKED, address,
                  MODBUS_DEVICE_FAILURE);
}

/* Why a write that has come to this address cannot go on there, with register i. */
static write_refusal_t refusal_of(unsigned i, uint32_t address, uint32_t end) {
    if (i == REGISTER_COUNT) {
        return WRITE_NO_REGISTER;
    }
    if (entries[i].access == REGISTER_RO) {
        return WRITE_READ_ONLY;
    }
    return entries[i].address != address || address + entries[i].registers > end ? WRITE_HALF : WRITE_TAKEN;
}

static modbus_exception_t check_addresses(span_t span) {
    for (uint32_t at = span.first; at < span.end;) {
        const unsigned i = find(at);
        const write_refusal_t refusal = refusal_of(i, at, span.end);
        if (refusal != WRITE_TAKEN) {
            return refuse(refusal, at, MODBUS_ILLEGAL_ADDRESS);
        }
        at += entries[i].registers;
    }
    return MODBUS_OK;
}

static modbus_exception_t check_block(span_t span) {
    const modbus_exception_t refusal = register_blocks_check_write((uint16_t)span.first);
    return refusal == MODBUS_OK ? MODBUS_OK : refuse(WRITE_READ_ONLY, span.first, refusal);
}

modbus_exception_t registers_check_write(uint16_t address, uint16_t count) {
    const span_t span = {address, (uint32_t)address + count};
    return register_blocks_hold(address, count) ? check_block(span) : check_addresses(span);
}

/* Puts the written values, whose addresses are right, over a copy of the present ones. */
static void decode_write(span_t span, const uint16_t values[], uint32_t candidate[REGISTER_COUNT]) {
    control_refresh(value);
    memcpy(candidate, value, sizeof value);
    for (uint32_t at = span.first; at < span.end;) {
        const unsigned i = find(at);
        candidate[i] = 0;
        for (unsigned part = 0; part < entries[i].registers; part++) {
            candidate[i] = candidate[i] << 16 | values[at - span.first + part];
        }
        at += entries[i].registers;
    }
}

static modbus_exception_t check_values(span_t span, const uint32_t candidate[REGISTER_COUNT]) {
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        if (covers(span, entries[i].address) && !control_setting_valid(i, candidate)) {
            return refuse(i == INDEX_command ? WRITE_COMMAND : WRITE_VALUE, entries[i].address, MODBUS_ILLEGAL_VALUE);
        }
    }
    return MODBUS_OK;
}

/* Whether the capture can be read once this is written, which goes to the table. */
static modbus_exception_t check_capture_after(span_t written, const uint16_t values[]) {
    uint32_t candidate[REGISTER_COUNT];
    decode_write(written, values, candidate);
    const modbus_exception_t refusal = check_values(written, candidate);
    if (refusal != MODBUS_OK) {
        return refusal;
    }
    return control_leaves_capture_readable(candidate) ? MODBUS_OK : MODBUS_DEVICE_FAILURE;
}

modbus_exception_t registers_check_read_after(uint16_t address, uint16_t count, uint16_t written, uint16_t write_count,
                                              const uint16_t values[]) {
    const modbus_exception_t now = registers_check_read(address, count);
    if (now == MODBUS_ILLEGAL_ADDRESS || !register_blocks_hold(address, count) || !register_blocks_capture(address)) {
        return now;
    }
    const modbus_exception_t refusal = registers_check_write(written, write_count);
    if (refusal != MODBUS_OK || register_blocks_hold(written, write_count)) {
        return refusal != MODBUS_OK ? refusal : now;
    }
    const span_t span = {written, (uint32_t)written + write_count};
    return check_capture_after(span, values);
}

static modbus_exception_t check_locks(span_t span, const uint32_t candidate[REGISTER_COUNT]) {
    modbus_exception_t refusal = MODBUS_OK;
    for (unsigned i = 0; i < REGISTER_COUNT && refusal == MODBUS_OK; i++) {
        if (covers(span, entries[i].address)) {
            refusal = check_lock(control_needs(i, candidate[i]), entries[i].address);
        }
    }
    return refusal;
}

static modbus_exception_t check_broadcast(span_t span, const uint32_t candidate[REGISTER_COUNT]) {
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        if (covers(span, entries[i].address) && !control_may_be_broadcast(i, candidate[i])) {
            return refuse(WRITE_BROADCAST, entries[i].address, MODBUS_ILLEGAL_VALUE);
        }
    }
    return MODBUS_OK;
}

static modbus_exception_t write_block(span_t span, const uint16_t values[]) {
    const uint16_t address = (uint16_t)span.first;
    modbus_exception_t refusal = check_block(span);
    if (refusal == MODBUS_OK) {
        refusal = check_lock(register_blocks_need(address), address);
    }
    if (refusal != MODBUS_OK) {
        return refusal;
    }
    refusal = register_blocks_write(address, (uint16_t)(span.end - span.first), values);
    return refusal == MODBUS_OK ? MODBUS_OK : refuse(WRITE_PLAYS, address, refusal);
}

static modbus_exception_t write_table(span_t span, const uint16_t values[], bool broadcast) {
    uint32_t candidate[REGISTER_COUNT];
    modbus_exception_t refusal = check_addresses(span);
    if (refusal != MODBUS_OK) {
        return refusal;
    }
    decode_write(span, values, candidate);
    if (broadcast) { /* first: it may not be, whatever each amplifier of the line would say to it */
        refusal = check_broadcast(span, candidate);
    }
    if (refusal == MODBUS_OK) {
        refusal = check_values(span, candidate);
    }
    if (refusal == MODBUS_OK) {
        refusal = check_locks(span, candidate);
    }
    if (refusal != MODBUS_OK) {
        return refusal;
    }
    const control_command_t command = (control_command_t)candidate[INDEX_command];
    candidate[INDEX_command] = 0; /* write only */
    memcpy(value, candidate, sizeof value);
    for (unsigned i = 0; i < REGISTER_COUNT; i++) {
        if (covers(span, entries[i].address)) {
            control_apply(i, value);
        }
    }
    control_execute(command, value);
    return MODBUS_OK;
}

modbus_exception_t registers_write(uint16_t address, uint16_t count, const uint16_t values[]) {
    const span_t span = {address, (uint32_t)address + count};
    return register_blocks_hold(address, count) ? write_block(span, values) : write_table(span, values, false);
}

modbus_exception_t registers_write_broadcast(uint16_t address, uint16_t count, const uint16_t values[]) {
    const span_t span = {address, (uint32_t)address + count};
    return register_blocks_hold(address, count) ? refuse(WRITE_BROADCAST, address, MODBUS_ILLEGAL_VALUE)
                                                : write_table(span, values, true);
}
