/* SPDX-License-Identifier: MIT */
#include "registers/register_blocks.h"
#include "loop/capture.h"
#include "loop/loop.h"
#include "registers/control.h"
#include "registers/register_table.h"
#include "store/event_log.h"
#include "store/parameter_store.h"
#include <string.h>

#define WORDS_PER_POINT 2U
#define WAVEFORM_POINTS (LENGTH_waveform / 2U / WORDS_PER_POINT)

_Static_assert(LENGTH_staging == 2U * PARAMETER_STORE_WORDS && LENGTH_active == LENGTH_staging, "two registers a word");
_Static_assert(LENGTH_event_log == EVENT_LOG_LENGTH * EVENT_LOG_REGISTERS, "the whole log can be read");
_Static_assert(LENGTH_capture == CAPTURE_WORDS, "the whole buffer can be read");

static source_point_t waveform[WAVEFORM_POINTS];

#define WORDS_PER_TONE 3U
_Static_assert(LENGTH_tones == 2U * WORDS_PER_TONE * SOURCE_TONES_MAX, "two registers a word");
static source_tone_t tones[SOURCE_TONES_MAX];

static const struct {
    uint16_t address, registers;
} blocks[] = {
#define BLOCK(name, address, registers, access, text) {address, registers},
#include "registers/registers.def"
};

static uint32_t stream_from;

void register_blocks_init(void) {
    stream_from = 0;
    memset(waveform, 0, sizeof waveform);
    memset(tones, 0, sizeof tones);
}

const source_point_t *register_blocks_waveform(void) {
    return waveform;
}

const source_tone_t *register_blocks_tones(void) {
    return tones;
}

void register_blocks_stream_from(uint32_t frame) {
    stream_from = frame;
}

bool register_blocks_hold(uint16_t address, uint16_t count) {
    for (size_t i = 0; i < sizeof blocks / sizeof blocks[0]; i++) {
        if (address >= blocks[i].address &&
            (uint32_t)address + count <= (uint32_t)blocks[i].address + blocks[i].registers) {
            return true;
        }
    }
    return false;
}

/* The start of the block that a register lies in. */
static uint16_t block_of(uint16_t address) {
    size_t i = 0;
    while (address - blocks[i].address >= blocks[i].registers) {
        i++;
    }
    return blocks[i].address;
}

bool register_blocks_capture(uint16_t address) {
    return block_of(address) == ADDRESS_capture;
}

modbus_exception_t register_blocks_check_read(uint16_t address) {
    return register_blocks_capture(address) && !capture_readable() ? MODBUS_DEVICE_FAILURE : MODBUS_OK;
}

/* Registers `index` on. The block has as many frames as fit before the request's end. */
static void read_stream(size_t index, uint16_t count, uint16_t values[]) {
    uint16_t all[LENGTH_stream] = {0};
    uint32_t first = stream_from;
    const size_t end = index + count;
    const size_t room = end > STREAM_HEADER ? end - STREAM_HEADER : 0;
    const uint16_t frames = capture_read(&first, (uint16_t)(room / capture_progress().width), all + STREAM_HEADER);
    const uint32_t key = board_lock();
    const capture_progress_t progress = capture_progress();
    const uint32_t sample = loop_samples() - progress.age;
    board_unlock(key);
    const uint16_t header[STREAM_HEADER] = {progress.number,
                                            progress.decimation,
                                            progress.signals,
                                            (uint16_t)(progress.written >> 16),
                                            (uint16_t)progress.written,
                                            (uint16_t)(sample >> 16),
                                            (uint16_t)sample,
                                            (uint16_t)(first >> 16),
                                            (uint16_t)first,
                                            frames};
    memcpy(all, header, sizeof header);
    memcpy(values, all + index, count * sizeof values[0]);
}

static uint32_t waveform_word(size_t word) {
    const source_point_t *point = &waveform[word / WORDS_PER_POINT];
    return word % WORDS_PER_POINT == 0 ? point->samples : (uint32_t)point->value;
}

static uint32_t tone_word(size_t word) {
    const source_tone_t *tone = &tones[word / WORDS_PER_TONE];
    switch (word % WORDS_PER_TONE) {
    case 0:
        return tone->harmonic;
    case 1:
        return (uint32_t)tone->amplitude;
    default:
        return tone->phase;
    }
}

static void set_tone_word(size_t word, uint32_t x) {
    source_tone_t *tone = &tones[word / WORDS_PER_TONE];
    switch (word % WORDS_PER_TONE) {
    case 0:
        tone->harmonic = x;
        break;
    case 1:
        tone->amplitude = (hyst_q31_t)x;
        break;
    default:
        tone->phase = x;
        break;
    }
}

static uint16_t read_register(uint16_t block, size_t index) {
    if (block == ADDRESS_capture) {
        return capture_register(index);
    }
    if (block == ADDRESS_event_log) {
        return event_log_register(index);
    }
    const size_t word = index / 2U;
    const uint32_t x = block == ADDRESS_waveform  ? waveform_word(word)
                       : block == ADDRESS_tones   ? tone_word(word)
                       : block == ADDRESS_staging ? parameter_store_staging()[word]
                                                  : parameter_store_active()[word];
    return (uint16_t)(index % 2U == 0 ? x >> 16 : x);
}

void register_blocks_read(uint16_t address, uint16_t count, uint16_t values[]) {
    const uint16_t block = block_of(address);
    if (block == ADDRESS_stream) {
        read_stream((size_t)(address - block), count, values);
        return;
    }
    for (uint16_t i = 0; i < count; i++) {
        values[i] = read_register(block, (size_t)(address - block) + i);
    }
}

static uint32_t with_half(uint32_t word, size_t index, uint16_t x) {
    return index % 2U == 0 ? (word & 0xFFFFU) | (uint32_t)x << 16 : (word & 0xFFFF0000U) | x;
}

static void write_register(uint16_t block, size_t index, uint16_t x) {
    const size_t word = index / 2U;
    if (block == ADDRESS_staging) {
        parameter_store_staging()[word] = with_half(parameter_store_staging()[word], index, x);
        return;
    }
    if (block == ADDRESS_tones) {
        set_tone_word(word, with_half(tone_word(word), index, x));
        return;
    }
    source_point_t *point = &waveform[word / WORDS_PER_POINT];
    const uint32_t changed = with_half(waveform_word(word), index, x);
    if (word % WORDS_PER_POINT == 0) {
        point->samples = changed;
    } else {
        point->value = (hyst_q31_t)changed;
    }
}

modbus_exception_t register_blocks_check_write(uint16_t address) {
    const uint16_t block = block_of(address);
    return block == ADDRESS_waveform || block == ADDRESS_tones || block == ADDRESS_staging ? MODBUS_OK
                                                                                           : MODBUS_ILLEGAL_ADDRESS;
}

uint32_t register_blocks_need(uint16_t address) {
    return block_of(address) == ADDRESS_staging ? CONTROL_PARAMETERS : CONTROL_OUTPUT;
}

modbus_exception_t register_blocks_write(uint16_t address, uint16_t count, const uint16_t values[]) {
    const uint16_t block = block_of(address);
    if ((block == ADDRESS_waveform && loop_plays(SOURCE_BREAKPOINTS)) ||
        (block == ADDRESS_tones && loop_plays(SOURCE_MULTISINE))) {
        return MODBUS_DEVICE_FAILURE; /* the interrupt reads the table */
    }
    for (uint16_t i = 0; i < count; i++) {
        write_register(block, (size_t)(address - block) + i, values[i]);
    }
    return MODBUS_OK;
}
