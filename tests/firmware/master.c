/* SPDX-License-Identifier: MIT */
#include "master.h"
#include "board.h"
#include "unity.h"
#include <string.h>

size_t master_frame(uint8_t frame[MODBUS_FRAME_MAX], uint8_t address, const uint8_t *pdu, size_t length) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT(MODBUS_FRAME_MAX - 3U, length);
    frame[0] = address;
    memcpy(frame + 1, pdu, length);
    const uint16_t crc = modbus_crc(frame, length + 1U);
    frame[length + 1U] = (uint8_t)crc;
    frame[length + 2U] = (uint8_t)(crc >> 8);
    return length + 3U;
}

size_t master_ask(const uint8_t *pdu, size_t length, uint8_t answer[MODBUS_FRAME_MAX]) {
    uint8_t frame[MODBUS_FRAME_MAX];
    uint8_t reply[MODBUS_FRAME_MAX];
    size_t reply_length;
    const size_t frame_length = master_frame(frame, (uint8_t)modbus_server_address(), pdu, length);
    const modbus_outcome_t outcome = modbus_serve(frame, frame_length, reply, &reply_length);
    TEST_ASSERT_TRUE(outcome == MODBUS_FRAME_ANSWERED || outcome == MODBUS_FRAME_REFUSED);
    TEST_ASSERT_TRUE((reply[1] >= 0x80U) == (outcome == MODBUS_FRAME_REFUSED));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(5, reply_length);
    TEST_ASSERT_EQUAL_HEX8((uint8_t)modbus_server_address(), reply[0]);
    TEST_ASSERT_EQUAL_HEX8(pdu[0], reply[1] & 0x7FU);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(0, modbus_crc(reply, reply_length), "CRC over a frame and its own CRC is 0");
    memcpy(answer, reply + 1, reply_length - 3U);
    return reply_length - 3U;
}

/* 0 when the answer is no exception. */
static modbus_exception_t exception_of(const uint8_t *answer, size_t length) {
    if ((answer[0] & 0x80U) == 0) {
        return MODBUS_OK;
    }
    TEST_ASSERT_EQUAL_UINT(2, length);
    TEST_ASSERT_NOT_EQUAL(0, answer[1]);
    return (modbus_exception_t)answer[1];
}

modbus_exception_t master_read(uint16_t address, uint16_t count, uint16_t values[]) {
    const uint8_t pdu[] = {3, (uint8_t)(address >> 8), (uint8_t)address, (uint8_t)(count >> 8), (uint8_t)count};
    uint8_t answer[MODBUS_FRAME_MAX];
    const size_t length = master_ask(pdu, sizeof pdu, answer);
    const modbus_exception_t exception = exception_of(answer, length);
    if (exception == MODBUS_OK) {
        TEST_ASSERT_EQUAL_UINT(2U + 2U * (size_t)count, length);
        TEST_ASSERT_EQUAL_UINT8(2U * count, answer[1]);
        for (size_t i = 0; i < count; i++) {
            values[i] = (uint16_t)(answer[2U + 2U * i] << 8 | answer[3U + 2U * i]);
        }
    }
    return exception;
}

modbus_exception_t master_write(uint16_t address, uint16_t count, const uint16_t values[]) {
    uint8_t pdu[MODBUS_FRAME_MAX] = {
        16, (uint8_t)(address >> 8), (uint8_t)address, (uint8_t)(count >> 8), (uint8_t)count, (uint8_t)(2U * count)};
    for (size_t i = 0; i < count; i++) {
        pdu[6U + 2U * i] = (uint8_t)(values[i] >> 8);
        pdu[7U + 2U * i] = (uint8_t)values[i];
    }
    uint8_t answer[MODBUS_FRAME_MAX];
    const size_t length = master_ask(pdu, 6U + 2U * (size_t)count, answer);
    const modbus_exception_t exception = exception_of(answer, length);
    if (exception == MODBUS_OK) {
        TEST_ASSERT_EQUAL_UINT(5, length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(pdu, answer, 5);
    }
    return exception;
}

uint32_t master_get(unsigned index) {
    const register_info_t *info = &register_table[index];
    const uint16_t size = (uint16_t)REGISTER_SIZE(info->type);
    uint16_t values[2] = {0, 0};
    if (info->address > ADDRESS_sequence) {
        master_command(COMMAND_LATCH);
    }
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_read(info->address, size, values), info->name);
    return size == 1 ? values[0] : (uint32_t)values[0] << 16 | values[1];
}

modbus_exception_t master_set(unsigned index, uint32_t value) {
    const register_info_t *info = &register_table[index];
    const uint16_t values[2] = {(uint16_t)(value >> 16), (uint16_t)value};
    return REGISTER_SIZE(info->type) == 1 ? master_write(info->address, 1, values + 1)
                                          : master_write(info->address, 2, values);
}

void master_put(unsigned index, uint32_t value) {
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(index, value), register_table[index].name);
}

uint32_t master_value_in_range(unsigned index) {
    switch (index) {
    case INDEX_drive_low: /* parked at 0 */
        return UINT32_MAX;
    case INDEX_drive_slew:
        return (uint32_t)board_info.fault_slew_min;
    case INDEX_line_baud:
        return LINE_BAUD_MIN;
    case INDEX_supply_low: /* the board's is above 1 */
    case INDEX_high_voltage_low:
        return INT32_MAX;
    default:
        return 1;
    }
}

void master_command(control_command_t command) {
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(INDEX_command, command), "command");
}

void master_write_words(uint16_t block, const uint32_t *words, size_t count) {
    uint16_t values[MODBUS_WRITE_MAX];
    for (size_t done = 0; done < count;) {
        size_t part = 0;
        for (; part < MODBUS_WRITE_MAX / 2U && done + part < count; part++) {
            values[2U * part] = (uint16_t)(words[done + part] >> 16);
            values[2U * part + 1U] = (uint16_t)words[done + part];
        }
        TEST_ASSERT_EQUAL(MODBUS_OK, master_write((uint16_t)(block + 2U * done), (uint16_t)(2U * part), values));
        done += part;
    }
}

static uint32_t word_at(const uint8_t *pdu, size_t length, size_t at) {
    return at + 1U < length ? (uint32_t)(pdu[at] << 8 | pdu[at + 1U]) : 0U;
}

uint32_t master_command_of(const uint8_t *pdu, size_t length) {
    const size_t at = pdu[0] == 23 ? 5 : 1;
    const uint32_t first = word_at(pdu, length, at), count = word_at(pdu, length, at + 2U);
    switch (pdu[0]) {
    case 5:
        return word_at(pdu, length, 3) != 0 ? COMMAND_ARM : COMMAND_DISARM;
    case 15:
        return length > 6U && (pdu[6] & 1U) != 0 ? COMMAND_ARM : COMMAND_DISARM;
    case 6:
        return first == ADDRESS_command ? count : 0U;
    case 22: /* what is masked reads as 0 */
        return first == ADDRESS_command ? word_at(pdu, length, 5) & ~count & 0xFFFFU : 0U;
    case 16:
    case 23:
        return first <= ADDRESS_command && first + count > ADDRESS_command
                   ? word_at(pdu, length, at + 5U + 2U * (ADDRESS_command - first))
                   : 0U;
    default:
        return 0;
    }
}
