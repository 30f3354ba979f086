/* SPDX-License-Identifier: MIT */
#include "lives_master.h"
#include "fake_board.h"
#include "loop/loop_memory.h"
#include "master.h"
#include "registers/registers.h"
#include "store/parameter_store.h"
#include "unity.h"
#include "wire.h"
#include <string.h>

enum { QUEUE_MAX = 24, PATIENCE = 2000, PAUSE_MIN = 90, PAUSE_MAX = 400, IMAGES = 64, FIRST_ID = 1000 };

typedef struct {
    uint8_t bytes[MODBUS_FRAME_MAX];
    size_t length; /* of the PDU */
} request_t;

/* Somebody who sends frames. */
typedef struct {
    request_t queue[QUEUE_MAX];
    unsigned first, count;
    uint8_t frame[MODBUS_FRAME_MAX];
    size_t length, sent;
    unsigned answers; /* there were before this request */
    unsigned wait, pause;
    bool waiting;
} sender_t;

static random_t *rng;
static sender_t master, stranger;
static lives_image_t images[IMAGES];
static unsigned image_count;

static int32_t between(int32_t low, int32_t high) {
    return random_between(rng, low, high);
}

static bool chance(int32_t one_in) {
    return between(1, one_in) == 1;
}

static uint32_t any_bits(void) {
    return (uint32_t)random_bits(rng);
}

/* Sending */

static void add(sender_t *sender, const uint8_t *pdu, size_t length) {
    TEST_ASSERT_LESS_THAN_UINT(QUEUE_MAX, sender->count);
    request_t *request = &sender->queue[(sender->first + sender->count++) % QUEUE_MAX];
    memcpy(request->bytes, pdu, length);
    request->length = length;
}

static uint8_t address_of(const sender_t *sender) {
    if (sender == &stranger && chance(4)) {
        return chance(2) ? (uint8_t)MODBUS_BROADCAST_ADDRESS : (uint8_t)any_bits();
    }
    return (uint8_t)modbus_server_address();
}

/* Begins the next request, if it is time. */
static void begin(sender_t *sender) {
    if (sender->pause > 0) {
        sender->pause--;
        return;
    }
    if (sender->count > 0) {
        const request_t *request = &sender->queue[sender->first];
        sender->length = master_frame(sender->frame, address_of(sender), request->bytes, request->length);
        sender->first = (sender->first + 1U) % QUEUE_MAX;
        sender->count--;
        sender->sent = 0;
        sender->answers = wire.answers;
    }
}

/* Returns whether there is nothing left to send. */
static bool send_byte(sender_t *sender) {
    if (sender->waiting) {
        sender->wait++;
        if (wire.answers != sender->answers || sender->wait > PATIENCE) {
            sender->waiting = false;
            sender->pause = (unsigned)between(PAUSE_MIN, PAUSE_MAX);
        }
    } else if (sender->sent < sender->length) {
        wire_byte(sender->frame[sender->sent++]);
        sender->waiting = sender->sent == sender->length;
        sender->wait = 0;
    } else {
        begin(sender);
    }
    return !sender->waiting && sender->sent == sender->length && sender->count == 0 && sender->pause == 0;
}

/* Requests */

/* Values to consecutive registers, by one of the functions that write. */
static void write_registers(sender_t *sender, uint16_t address, const uint16_t *values, uint8_t count) {
    uint8_t pdu[MODBUS_FRAME_MAX] = {0};
    const bool and_read = chance(4);
    size_t at = 0;
    if (count == 1 && chance(2)) {
        const bool mask = chance(3);
        const uint8_t single[] = {mask ? 22 : 6,
                                  (uint8_t)(address >> 8),
                                  (uint8_t)address,
                                  mask ? 0 : (uint8_t)(values[0] >> 8),
                                  mask ? 0 : (uint8_t)values[0],
                                  (uint8_t)(values[0] >> 8),
                                  (uint8_t)values[0]};
        add(sender, single, mask ? 7 : 5);
        return;
    }
    if (and_read) {
        const uint8_t reads[] = {23, ADDRESS_fault_code >> 8, ADDRESS_fault_code & 0xFF, 0, 3};
        memcpy(pdu, reads, sizeof reads);
        at = sizeof reads;
    } else {
        pdu[at++] = 16;
    }
    const uint8_t writes[] = {(uint8_t)(address >> 8), (uint8_t)address, 0, count, (uint8_t)(2U * count)};
    memcpy(pdu + at, writes, sizeof writes);
    at += sizeof writes;
    for (unsigned i = 0; i < count; i++) {
        pdu[at++] = (uint8_t)(values[i] >> 8);
        pdu[at++] = (uint8_t)values[i];
    }
    add(sender, pdu, at);
}

static void write_value(sender_t *sender, unsigned index, uint32_t value) {
    const register_info_t *info = &register_table[index];
    const uint16_t values[] = {(uint16_t)(value >> 16), (uint16_t)value};
    const uint8_t size = REGISTER_SIZE(info->type);
    write_registers(sender, info->address, values + 2U - size, size);
}

static void command(sender_t *sender, uint32_t what) {
    if ((what == COMMAND_ARM || what == COMMAND_DISARM) && chance(4)) {
        const bool many = chance(2), on = what == COMMAND_ARM;
        const uint8_t coil[] = {5, 0, 0, on ? 0xFF : 0, 0}, coils[] = {15, 0, 0, 0, 1, 1, on};
        add(sender, many ? coils : coil, many ? sizeof coils : sizeof coil);
        return;
    }
    write_value(sender, INDEX_command, what);
}

static void read_registers(sender_t *sender, uint16_t address, uint8_t count) {
    const uint8_t pdu[] = {chance(2) ? 3 : 4, (uint8_t)(address >> 8), (uint8_t)address, 0, count};
    add(sender, pdu, sizeof pdu);
}

/* Images */

lives_image_t lives_image(uint32_t id) {
    if (id >= FIRST_ID && id < FIRST_ID + image_count) {
        return images[(id - FIRST_ID) % IMAGES];
    }
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    return (lives_image_t){.id = id,
                           .low = p.drive_low,
                           .high = p.drive_high,
                           .park = (hyst_q31_t)((uint32_t)(FAKE_SAFE_CODE ^ BOARD_CODE_MIDDLE) << 16),
                           .slew = p.transition_slew};
}

static hyst_q31_t between_q31(hyst_q31_t low, hyst_q31_t high) {
    return (hyst_q31_t)(low + (int64_t)((double)((int64_t)high - low) * random_unit(rng)));
}

/* A play bank of a few operators, or none, between limits of any kind. */
static lives_image_t new_image(hyst_parameters_t *p) {
    lives_image_t image = {.id = FIRST_ID + image_count};
    image.low = chance(3) ? HYST_Q31_MIN : between_q31(HYST_Q31_MIN, HYST_Q31_MAX - (1 << 28));
    image.high = chance(3) ? HYST_Q31_MAX : between_q31(image.low + (1 << 26), HYST_Q31_MAX);
    image.park = chance(6) ? image.low : chance(6) ? image.high : between_q31(image.low, image.high);
    image.slew = (hyst_q31_t)((INT64_C(1) << 32) / between(110, LIVES_SLOWEST_RAMP));
    hyst_parameters_default(p);
    p->model_id = image.id;
    p->drive_low = image.low;
    p->drive_high = image.high;
    p->drive_park = image.park;
    p->transition_slew = image.slew;
    p->lookahead_samples = (uint32_t)between(0, 8);
    p->pi_operators = (uint32_t)between(0, 8);
    for (uint32_t i = 0; i < p->pi_operators; i++) {
        p->pi_threshold[i] = (hyst_q31_t)((i + 1U) << (22 + between(0, 0)));
        p->pi_weight[i + 1U] = HYST_Q28_ONE / 256 * between(1, 20);
    }
    images[image_count++ % IMAGES] = image;
    return image;
}

static void upload(bool damaged) {
    static hyst_parameters_t p;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    uint16_t values[MODBUS_WRITE_MAX];
    if (image_count == IMAGES) {
        return;
    }
    (void)new_image(&p);
    const size_t count = hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS);
    if (damaged) {
        words[between(0, (int32_t)count - 1)] ^= 1U << between(0, 31);
    }
    for (size_t done = 0; done < count;) {
        size_t part = 0;
        for (; part < 50 && done + part < count; part++) {
            values[2U * part] = (uint16_t)(words[done + part] >> 16);
            values[2U * part + 1U] = (uint16_t)words[done + part];
        }
        write_registers(&master, (uint16_t)(ADDRESS_staging + 2U * done), values, (uint8_t)(2U * part));
        done += part;
    }
    command(&master, COMMAND_COMMIT);
    if (chance(6)) {
        command(&master, COMMAND_COMMIT); /* the same again, while the first is being taken over */
    }
}

/* What the master wants */

static void unlock(void) {
    write_value(&master, INDEX_unlock, CONTROL_KEY_PARAMETERS);
    write_value(&master, INDEX_unlock, CONTROL_KEY_OUTPUT);
}

static void play(void) {
    const uint32_t kind = (uint32_t)between(1, 4);
    write_value(&master, INDEX_source, kind);
    write_value(&master, INDEX_source_offset, any_bits());
    write_value(&master, INDEX_source_amplitude, any_bits());
    write_value(&master, INDEX_source_increment, (any_bits() >> between(1, 16)) | 1U);
    write_value(&master, INDEX_source_cycles, (uint32_t)between(0, 3));
    if (kind == SOURCE_BREAKPOINTS) {
        uint16_t points[4 * 4];
        for (unsigned i = 0; i < sizeof points / sizeof points[0]; i++) {
            points[i] = i % 4U == 0 ? 0 : i % 4U == 1 ? (uint16_t)between(0, 500) : (uint16_t)any_bits();
        }
        write_registers(&master, ADDRESS_waveform, points, sizeof points / sizeof points[0]);
        write_value(&master, INDEX_waveform_points, (uint32_t)between(1, 4));
    } else if (kind == SOURCE_SWEEP) {
        write_value(&master, INDEX_sweep_increment, (any_bits() >> between(1, 16)) | 1U);
        write_value(&master, INDEX_sweep_samples, (uint32_t)between(1, 5000));
        write_value(&master, INDEX_sweep_spacing, (uint32_t)between(0, 1));
    } else if (kind == SOURCE_MULTISINE) {
        const uint16_t tones[] = {0, 1, 0x2000, 0, 0, 0, 0, 3, 0x1000, 0, 0x4000, 0};
        write_registers(&master, ADDRESS_tones, tones, sizeof tones / sizeof tones[0]);
        write_value(&master, INDEX_source_tones, 2);
    }
    command(&master, COMMAND_START);
}

static void limits(void) {
    const hyst_q31_t low = between_q31(HYST_Q31_MIN, HYST_Q31_MAX - 2), high = between_q31(low + 1, HYST_Q31_MAX);
    const hyst_q31_t park = loop.active->image_range.park;
    const bool wide = chance(3), holds_park = chance(2);
    const uint32_t from = (uint32_t)(wide ? HYST_Q31_MIN : holds_park && low > park ? park : low);
    const uint32_t to = (uint32_t)(wide ? HYST_Q31_MAX : holds_park && high < park ? park : high);
    const uint16_t values[] = {(uint16_t)(from >> 16), (uint16_t)from, (uint16_t)(to >> 16), (uint16_t)to};
    write_registers(&master, chance(3) ? ADDRESS_reference_low : ADDRESS_drive_low, values, 4);
}

static void record(void) {
    write_value(&master, INDEX_capture_signals, (uint32_t)between(1, 127));
    write_value(&master, INDEX_capture_trigger, (uint32_t)between(0, 4));
    write_value(&master, INDEX_capture_length, (uint32_t)between(0, 4000));
    write_value(&master, INDEX_capture_before, (uint32_t)between(0, 100));
    command(&master, chance(4) ? COMMAND_END_CAPTURE : COMMAND_ARM_CAPTURE);
}

static void look(void) {
    static const uint16_t at[] = {ADDRESS_sequence, ADDRESS_capture, ADDRESS_stream, ADDRESS_event_log, ADDRESS_active};
    read_registers(&master, at[between(0, sizeof at / sizeof at[0] - 1)], (uint8_t)between(2, 30) & 0xFEU);
}

static void settle_line(void) {
    write_value(&master, INDEX_line_address, (uint32_t)between(1, 247));
    write_value(&master, INDEX_line_parity, (uint32_t)between(0, 2));
    command(&master, COMMAND_SAVE_LINE);
}

static void anything(void) {
    static const unsigned slews[] = {INDEX_setpoint_slew, INDEX_reference_slew, INDEX_model_error_limit};
    switch (between(0, 24)) {
    case 0:
    case 1:
        upload(false);
        break;
    case 2:
        upload(true);
        break;
    case 3:
        command(&master, COMMAND_ARM);
        break;
    case 4:
        command(&master, COMMAND_DISARM);
        break;
    case 5:
        command(&master, COMMAND_STOP);
        break;
    case 6:
        command(&master, COMMAND_PARK);
        break;
    case 7:
    case 8:
        write_value(&master, INDEX_mode, (uint32_t)between(0, 3));
        break;
    case 9:
    case 10:
    case 11:
        write_value(&master, INDEX_setpoint, any_bits());
        break;
    case 12:
    case 13:
        play();
        break;
    case 14:
        command(&master, COMMAND_CONDITION);
        break;
    case 15:
    case 16:
        limits();
        break;
    case 17:
        write_value(&master, slews[between(0, 2)], any_bits() >> between(1, 12));
        break;
    case 18:
        write_value(&master, INDEX_current_limit, chance(2) ? 0 : any_bits() >> between(1, 10));
        break;
    case 19:
        write_value(&master, INDEX_watchdog, chance(4) ? 0 : (uint32_t)between(50, 2000));
        break;
    case 20:
        command(&master, chance(2) ? COMMAND_SAVE : (uint32_t)between(0, 15));
        break;
    case 21:
        record();
        break;
    case 22:
        settle_line();
        break;
    case 23:
        write_value(&master, INDEX_drive_slew,
                    (uint32_t)between(FAKE_FAULT_SLEW_MIN - 1000, chance(2) ? 1 << 26 : FAKE_DRIVE_SLEW_MAX + 1000));
        break;
    default:
        look();
        break;
    }
}

/* What brings a master on its way, more often than not. */
static void next_wish(void) {
    uint16_t unlocked;
    registers_read(ADDRESS_unlocked, 1, &unlocked);
    const uint32_t state = loop.telemetry.amplifier_state;
    if (unlocked != 3 && chance(2)) {
        unlock();
    } else if (!parameter_store_image_given() && chance(2)) {
        upload(false);
    } else if (state == AMPLIFIER_OFF && chance(3)) {
        command(&master, COMMAND_ARM);
    } else if (state == AMPLIFIER_OFF && chance(fake_store.cutting ? 2 : 6)) {
        command(&master, COMMAND_SAVE);
    } else if (state == AMPLIFIER_FAULT && chance(5)) {
        command(&master, COMMAND_STOP);
    } else if (state == AMPLIFIER_HOLD && loop.mode == HYST_MODE_PARK && chance(2)) {
        write_value(&master, INDEX_mode, (uint32_t)between(1, 3));
    } else {
        anything();
    }
}

/* A register or a few, whatever is there; or a command; or a function that there is not. */
static void next_mischief(void) {
    uint16_t values[8];
    for (unsigned i = 0; i < 8; i++) {
        values[i] = chance(2) ? (uint16_t)any_bits() : (uint16_t)between(0, 15);
    }
    switch (between(0, 4)) {
    case 0:
        command(&stranger, (uint32_t)between(0, 14));
        break;
    case 1:
        write_value(&stranger, INDEX_unlock, chance(2) ? CONTROL_KEY_OUTPUT : CONTROL_KEY_PARAMETERS);
        break;
    case 2: {
        const uint8_t odd[] = {(uint8_t)any_bits(), 0, (uint8_t)any_bits(), 0, (uint8_t)any_bits()};
        add(&stranger, odd, (size_t)between(1, sizeof odd));
        break;
    }
    default:
        write_registers(&stranger, (uint16_t)(0x100 + between(0, 0x40)), values, (uint8_t)between(1, 8));
        break;
    }
}

void lives_master_begin(random_t *random) {
    rng = random;
    image_count = 0;
}

void lives_master_start(void) {
    memset(&master, 0, sizeof master);
    memset(&stranger, 0, sizeof stranger);
}

void lives_master_byte(void) {
    if (send_byte(&master)) {
        next_wish();
    }
}

void lives_stranger_byte(void) {
    if (send_byte(&stranger)) {
        next_mischief();
    }
}
