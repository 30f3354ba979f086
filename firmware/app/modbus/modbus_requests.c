/* SPDX-License-Identifier: MIT */
#include "modbus/modbus_bits.h"
#include "modbus/modbus_server.h"
#include "registers/register_table.h"
#include "registers/registers.h"

#define CRC_BYTES     2U
#define FRAME_MIN     (2U + CRC_BYTES) /* address and function */
#define EXCEPTION_BIT 0x80U

#define READ_BITS_MAX  2000U
#define WRITE_BITS_MAX 1968U
#define COIL_ON        0xFF00U

enum { DIAGNOSE_QUERY_DATA = 0, DIAGNOSE_CLEAR = 10, DIAGNOSE_ERRORS = 12, DIAGNOSE_MESSAGES = 14 };

#define TEXT_OF(x)  TEXT_OF_(x)
#define TEXT_OF_(x) #x

uint16_t modbus_crc(const uint8_t *bytes, size_t count) {
    uint32_t crc = 0xFFFFU;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ (0xA001U & (0U - (crc & 1U)));
        }
    }
    return (uint16_t)crc;
}

size_t modbus_request_length(const uint8_t *frame, size_t length) {
    const uint8_t function = length < FRAME_MIN ? 0 : frame[1];
    size_t count_at; /* where the bytes of what is written are counted; they are the last before the CRC */
    switch (function) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 5:
    case 6:
        return 8;
    case 22:
        return 10;
    case 15:
    case 16:
        count_at = 6;
        break;
    case 23:
        count_at = 10;
        break;
    default:
        return 0;
    }
    return length > count_at ? count_at + 1U + frame[count_at] + CRC_BYTES : 0;
}

static uint16_t get16(const uint8_t *at) {
    return (uint16_t)(at[0] << 8 | at[1]);
}

static void put16(uint8_t *at, uint16_t x) {
    at[0] = (uint8_t)(x >> 8);
    at[1] = (uint8_t)x;
}

/* A protocol data unit: function code and what follows, without address and CRC. */
typedef struct {
    const uint8_t *bytes;
    size_t length;  /* 1 or more */
    bool broadcast; /* to every amplifier of the line */
} request_t;

/* The answer to it. bytes[0], the function, is there already. */
typedef struct {
    uint8_t *bytes;
    size_t length;
} reply_t;

static bool count_legal(uint16_t count, uint16_t most) {
    return count >= 1 && count <= most;
}

/* Byte count and registers, from bytes[1] on. */
static void answer_registers(uint16_t address, uint16_t count, reply_t *reply) {
    uint16_t values[MODBUS_READ_MAX];
    registers_read(address, count, values);
    reply->bytes[1] = (uint8_t)(2U * count);
    for (size_t i = 0; i < count; i++) {
        put16(reply->bytes + 2U + 2U * i, values[i]);
    }
    reply->length = 2U + 2U * (size_t)count;
}

/* Every write of every function comes through here. */
static modbus_exception_t write(request_t request, uint16_t address, uint16_t count, const uint16_t values[]) {
    return request.broadcast ? registers_write_broadcast(address, count, values)
                             : registers_write(address, count, values);
}

static void get_values(const uint8_t *bytes, uint16_t count, uint16_t values[]) {
    for (size_t i = 0; i < count; i++) {
        values[i] = get16(bytes + 2U * i);
    }
}

static modbus_exception_t read_registers(request_t request, reply_t *reply) {
    if (request.length != 5U || !count_legal(get16(request.bytes + 3), MODBUS_READ_MAX)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint16_t address = get16(request.bytes + 1);
    const uint16_t count = get16(request.bytes + 3);
    const modbus_exception_t refusal = registers_check_read(address, count);
    if (refusal == MODBUS_OK) {
        answer_registers(address, count, reply);
    }
    return refusal;
}

/* Functions that write are answered with so many first bytes of the request. */
static void answer_echo(request_t request, size_t length, reply_t *reply) {
    for (size_t i = 1; i < length; i++) {
        reply->bytes[i] = request.bytes[i];
    }
    reply->length = length;
}

static modbus_exception_t write_register(request_t request, reply_t *reply) {
    if (request.length != 5U) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint16_t value = get16(request.bytes + 3);
    const modbus_exception_t refusal = write(request, get16(request.bytes + 1), 1, &value);
    answer_echo(request, 5U, reply);
    return refusal;
}

static modbus_exception_t write_registers(request_t request, reply_t *reply) {
    if (request.length < 6U) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint16_t count = get16(request.bytes + 3);
    if (!count_legal(count, MODBUS_WRITE_MAX) || request.bytes[5] != 2U * count ||
        request.length != 6U + 2U * (size_t)count) {
        return MODBUS_ILLEGAL_VALUE;
    }
    uint16_t values[MODBUS_WRITE_MAX];
    get_values(request.bytes + 6, count, values);
    const modbus_exception_t refusal = write(request, get16(request.bytes + 1), count, values);
    answer_echo(request, 5U, reply);
    return refusal;
}

static modbus_exception_t write_and_read_registers(request_t request, reply_t *reply) {
    if (request.length < 10U) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint16_t read_address = get16(request.bytes + 1);
    const uint16_t read_count = get16(request.bytes + 3);
    const uint16_t write_address = get16(request.bytes + 5);
    const uint16_t write_count = get16(request.bytes + 7);
    if (!count_legal(read_count, MODBUS_READ_MAX) || !count_legal(write_count, MODBUS_READ_WRITE_MAX) ||
        request.bytes[9] != 2U * write_count || request.length != 10U + 2U * (size_t)write_count) {
        return MODBUS_ILLEGAL_VALUE;
    }
    uint16_t values[MODBUS_READ_WRITE_MAX];
    get_values(request.bytes + 10, write_count, values);
    modbus_exception_t refusal =
        registers_check_read_after(read_address, read_count, write_address, write_count, values);
    if (refusal == MODBUS_OK) {
        refusal = write(request, write_address, write_count, values);
    }
    if (refusal == MODBUS_OK) {
        answer_registers(read_address, read_count, reply);
    }
    return refusal;
}

/* Functions 1 and 2. `bits`: all that there are. */
static modbus_exception_t read_bits(request_t request, const uint8_t *bits, uint32_t available, reply_t *reply) {
    if (request.length != 5U || !count_legal(get16(request.bytes + 3), READ_BITS_MAX)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint32_t first = get16(request.bytes + 1);
    const uint32_t count = get16(request.bytes + 3);
    if (first + count > available) {
        return MODBUS_ILLEGAL_ADDRESS;
    }
    const size_t bytes = (count + 7U) / 8U;
    reply->bytes[1] = (uint8_t)bytes;
    for (size_t i = 0; i < bytes; i++) {
        reply->bytes[2U + i] = 0;
    }
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t bit = (uint32_t)bits[(first + i) / 8U] >> (first + i) % 8U & 1U;
        reply->bytes[2U + i / 8U] |= (uint8_t)(bit << i % 8U);
    }
    reply->length = 2U + bytes;
    return MODBUS_OK;
}

static modbus_exception_t read_coils(request_t request, reply_t *reply) {
    const uint8_t coil = modbus_coil() ? 1 : 0;
    return read_bits(request, &coil, MODBUS_COILS, reply);
}

static modbus_exception_t read_discrete_inputs(request_t request, reply_t *reply) {
    uint8_t bits[(MODBUS_DISCRETE_INPUTS + 7U) / 8U];
    modbus_discrete_inputs(bits);
    return read_bits(request, bits, MODBUS_DISCRETE_INPUTS, reply);
}

static modbus_exception_t set_coil(request_t request, bool on) {
    const uint16_t command = modbus_coil_command(on);
    return write(request, ADDRESS_command, 1, &command);
}

static modbus_exception_t write_coil(request_t request, reply_t *reply) {
    if (request.length != 5U || (get16(request.bytes + 3) != COIL_ON && get16(request.bytes + 3) != 0)) {
        return MODBUS_ILLEGAL_VALUE;
    }
    if (get16(request.bytes + 1) >= MODBUS_COILS) {
        return MODBUS_ILLEGAL_ADDRESS;
    }
    answer_echo(request, 5U, reply);
    return set_coil(request, get16(request.bytes + 3) == COIL_ON);
}

static modbus_exception_t write_coils(request_t request, reply_t *reply) {
    if (request.length < 6U) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint32_t first = get16(request.bytes + 1);
    const uint32_t count = get16(request.bytes + 3);
    const size_t bytes = (count + 7U) / 8U;
    if (!count_legal((uint16_t)count, WRITE_BITS_MAX) || request.bytes[5] != bytes || request.length != 6U + bytes) {
        return MODBUS_ILLEGAL_VALUE;
    }
    if (first + count > MODBUS_COILS) {
        return MODBUS_ILLEGAL_ADDRESS;
    }
    answer_echo(request, 5U, reply);
    return set_coil(request, (request.bytes[6] & 1U) != 0);
}

static modbus_exception_t mask_register(request_t request, reply_t *reply) {
    if (request.length != 7U) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint16_t address = get16(request.bytes + 1);
    const uint16_t keep = get16(request.bytes + 3);
    const uint16_t set = get16(request.bytes + 5);
    uint16_t value = 0;
    modbus_exception_t refusal = registers_check_read(address, 1);
    if (refusal == MODBUS_DEVICE_FAILURE) { /* what cannot be read now cannot be written ever */
        refusal = registers_check_write(address, 1);
    }
    if (refusal == MODBUS_OK) {
        registers_read(address, 1, &value);
        value = (uint16_t)((value & keep) | (set & ~(uint32_t)keep));
        refusal = write(request, address, 1, &value);
    }
    answer_echo(request, 7U, reply);
    return refusal;
}

/* Function 8: return query data, clear counters, and the counters of the line. */
static modbus_exception_t diagnose(request_t request, reply_t *reply) {
    if (request.length < 5U || request.length % 2U == 0) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint16_t which = get16(request.bytes + 1);
    if (which == DIAGNOSE_QUERY_DATA) { /* any data, as long as a frame may be */
        answer_echo(request, request.length, reply);
        return MODBUS_OK;
    }
    if (which != DIAGNOSE_CLEAR && which != DIAGNOSE_ERRORS && which != DIAGNOSE_MESSAGES) {
        return MODBUS_ILLEGAL_FUNCTION;
    }
    if (request.length != 5U || get16(request.bytes + 3) != 0) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const modbus_counters_t counters = modbus_server_counters();
    answer_echo(request, 5U, reply);
    if (which == DIAGNOSE_CLEAR) {
        modbus_server_clear();
    } else {
        put16(reply->bytes + 3, which == DIAGNOSE_ERRORS ? counters.errors : counters.served);
    }
    return MODBUS_OK;
}

/* Objects 0 to 2: the basic category. The serial number is one of the extended category. */
static const char *const identification[] = {
    "hyst",
    "piezo amplifier",
    TEXT_OF(HYST_VERSION_MAJOR) "." TEXT_OF(HYST_VERSION_MINOR) "." TEXT_OF(HYST_VERSION_PATCH),
};
#define IDENTIFICATION_OBJECTS (sizeof identification / sizeof identification[0])

enum {
    MEI_READ_DEVICE_IDENTIFICATION = 14,
    ACCESS_BASIC = 1,
    ACCESS_EXTENDED = 3,
    ACCESS_INDIVIDUAL = 4,
    CONFORMITY_EXTENDED = 0x83, /* all three categories, stream and individual access */
    OBJECT_SERIAL = 0x80,
    SERIAL_DIGITS = 24
};

/* The registers serial_high to serial_low in hexadecimal. */
static void serial_text(char text[SERIAL_DIGITS + 1]) {
    uint16_t words[SERIAL_DIGITS / 4U];
    registers_read(ADDRESS_serial_high, SERIAL_DIGITS / 4U, words);
    for (unsigned i = 0; i < SERIAL_DIGITS; i++) {
        text[i] = "0123456789ABCDEF"[(unsigned)words[i / 4U] >> (12U - 4U * (i % 4U)) & 0xFU];
    }
    text[SERIAL_DIGITS] = '\0';
}

static void append_object(uint8_t object, reply_t *reply) {
    char serial[SERIAL_DIGITS + 1];
    const char *text = serial;
    uint8_t *at = reply->bytes + reply->length;
    size_t length = 0;
    if (object == OBJECT_SERIAL) {
        serial_text(serial);
    } else {
        text = identification[object];
    }
    for (; text[length] != '\0'; length++) {
        at[2U + length] = (uint8_t)text[length];
    }
    at[0] = object;
    at[1] = (uint8_t)length;
    reply->length += 2U + length;
}

static modbus_exception_t read_identification(request_t request, reply_t *reply) {
    if (request.length < 2U || request.bytes[1] != MEI_READ_DEVICE_IDENTIFICATION) {
        return MODBUS_ILLEGAL_FUNCTION;
    }
    if (request.length != 4U || request.bytes[2] < ACCESS_BASIC || request.bytes[2] > ACCESS_INDIVIDUAL) {
        return MODBUS_ILLEGAL_VALUE;
    }
    const uint8_t access = request.bytes[2];
    const bool individual = access == ACCESS_INDIVIDUAL;
    const bool extended = access >= ACCESS_EXTENDED;
    uint8_t object = request.bytes[3];
    if (object >= IDENTIFICATION_OBJECTS && !(extended && object == OBJECT_SERIAL)) {
        if (individual) {
            return MODBUS_ILLEGAL_ADDRESS;
        }
        object = 0; /* a stream restarts at the beginning (V1.1b3, section 6.21) */
    }
    const uint8_t basic = object < IDENTIFICATION_OBJECTS ? (uint8_t)(IDENTIFICATION_OBJECTS - object) : 0;
    const uint8_t objects = individual ? 1U : (uint8_t)(basic + (extended ? 1U : 0U));
    const uint8_t header[] = {MEI_READ_DEVICE_IDENTIFICATION, access, CONFORMITY_EXTENDED, 0, 0, objects};
    for (size_t i = 0; i < sizeof header; i++) {
        reply->bytes[1U + i] = header[i];
    }
    reply->length = 1U + sizeof header;
    for (uint8_t i = 0; i < objects; i++) {
        append_object(!individual && i >= basic ? OBJECT_SERIAL : (uint8_t)(object + i), reply);
    }
    return MODBUS_OK;
}

/* Without an answer nothing can be read. What may be written: control_may_be_broadcast. */
static bool may_be_broadcast(uint8_t function) {
    return function == 5 || function == 6 || function == 15 || function == 16 || function == 22;
}

static modbus_exception_t dispatch(request_t request, reply_t *reply) {
    switch (request.bytes[0]) {
    case 1:
        return read_coils(request, reply);
    case 2:
        return read_discrete_inputs(request, reply);
    case 5:
        return write_coil(request, reply);
    case 8:
        return diagnose(request, reply);
    case 15:
        return write_coils(request, reply);
    case 22:
        return mask_register(request, reply);
    case 3:
    case 4:
        return read_registers(request, reply);
    case 6:
        return write_register(request, reply);
    case 16:
        return write_registers(request, reply);
    case 23:
        return write_and_read_registers(request, reply);
    case 43:
        return read_identification(request, reply);
    default:
        return MODBUS_ILLEGAL_FUNCTION;
    }
}

modbus_outcome_t modbus_serve(const uint8_t *frame, size_t length, uint8_t reply[MODBUS_FRAME_MAX],
                              size_t *reply_length) {
    *reply_length = 0;
    if (length < FRAME_MIN || length > MODBUS_FRAME_MAX) {
        return MODBUS_FRAME_BROKEN;
    }
    const size_t payload = length - CRC_BYTES;
    if (modbus_crc(frame, payload) != (frame[payload] | frame[payload + 1U] << 8)) {
        return MODBUS_FRAME_BROKEN;
    }
    const bool broadcast = frame[0] == MODBUS_BROADCAST_ADDRESS;
    if ((frame[0] != modbus_server_address() && !broadcast) || frame[1] >= EXCEPTION_BIT ||
        (broadcast && !may_be_broadcast(frame[1]))) {
        return MODBUS_FRAME_FOREIGN;
    }

    reply[0] = frame[0];
    reply[1] = frame[1];
    reply_t answer = {.bytes = reply + 1};
    const modbus_exception_t refusal =
        dispatch((request_t){.bytes = frame + 1, .length = payload - 1U, .broadcast = broadcast}, &answer);
    if (broadcast) {
        return refusal == MODBUS_OK ? MODBUS_FRAME_BROADCAST : MODBUS_FRAME_REFUSED;
    }
    if (refusal != MODBUS_OK) {
        reply[1] |= EXCEPTION_BIT;
        reply[2] = (uint8_t)refusal;
        answer.length = 2U;
    }
    const uint16_t crc = modbus_crc(reply, answer.length + 1U);
    reply[answer.length + 1U] = (uint8_t)crc;
    reply[answer.length + 2U] = (uint8_t)(crc >> 8);
    *reply_length = answer.length + 1U + CRC_BYTES;
    return refusal == MODBUS_OK ? MODBUS_FRAME_ANSWERED : MODBUS_FRAME_REFUSED;
}
