/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/stream_reader.h"
#include "amplifier/device/sample_number.h"
#include "base/monotonic_clock.h"
#include <math.h>
#include <string.h>

/* Blocks that the line is measured with: a USB adapter that waits 16 ms now and then does so in one of them. */
#define MEASURED_BLOCKS 8

static unsigned width_of(unsigned signals) {
    unsigned width = 0;
    for (unsigned rest = signals; rest != 0; rest &= rest - 1U) {
        width++;
    }
    return width;
}

bool stream_arm(device_t *device, unsigned signals, unsigned decimation, capture_trigger_t trigger,
                failure_t *failure) {
    return device_unlock(device, CONTROL_PARAMETERS, failure) &&
           device_write(device, INDEX_capture_before, 0, failure) &&
           device_write(device, INDEX_capture_signals, (int64_t)signals, failure) &&
           device_write(device, INDEX_capture_decimation, (int64_t)decimation, failure) &&
           device_write(device, INDEX_capture_length, CAPTURE_ENDLESS, failure) &&
           device_write(device, INDEX_capture_trigger, (int64_t)trigger, failure) &&
           device_command(device, COMMAND_ARM_CAPTURE, failure);
}

static uint32_t u32(const uint16_t *words) {
    return (uint32_t)words[0] << 16 | words[1];
}

static bool decode(stream_reader_t *reader, const uint16_t words[LENGTH_stream], stream_block_t *block,
                   failure_t *failure) {
    const uint32_t written = u32(words + 3);
    block->decimation = words[1];
    block->signals = words[2];
    block->width = width_of(block->signals);
    block->first = u32(words + 7);
    block->frames = words[9];
    if (block->width == 0 || block->frames * block->width > STREAM_FRAME_REGISTERS) {
        return fail(failure, "the amplifier sends a block that cannot be: %zu frames of signals 0x%X", block->frames,
                    block->signals);
    }
    block->lost = block->first - reader->next;
    block->behind = written - block->first - (uint32_t)block->frames;
    if (!reader->timed && written > 0) {
        reader->timed = true;
        reader->sample = u32(words + 5) - block->decimation * (written - 1U);
    }
    block->sample = reader->sample + block->decimation * block->first;
    memcpy(block->value, words + STREAM_HEADER, sizeof block->value);
    return true;
}

bool stream_read(stream_reader_t *reader, stream_block_t *block, failure_t *failure) {
    uint16_t words[LENGTH_stream];
    block->restarted = false;
    for (;;) {
        if (!device_read_stream(reader->device, reader->next, LENGTH_stream, words, failure)) {
            return false;
        }
        if (reader->begun && words[0] == reader->number) {
            break;
        }
        reader->begun = true;
        reader->timed = false;
        reader->number = words[0];
        block->restarted = true;
        if (reader->next == 0) {
            break;
        }
        reader->next = 0;
    }
    if (!decode(reader, words, block, failure)) {
        return false;
    }
    reader->next = block->first + (uint32_t)block->frames;
    return true;
}

bool stream_measure(device_t *device, stream_pace_t *pace, failure_t *failure) {
    int64_t first, last;
    uint16_t words[LENGTH_stream];
    pace->block_s = 0.0;
    if (!device_read(device, INDEX_sequence, &first, failure)) {
        return false;
    }
    const double first_s = monotonic_s();
    for (int i = 0; i < MEASURED_BLOCKS; i++) {
        const double begun_s = monotonic_s();
        if (!device_read_stream(device, 0, LENGTH_stream, words, failure)) {
            return false;
        }
        pace->block_s = fmax(pace->block_s, monotonic_s() - begun_s);
    }
    if (!device_read(device, INDEX_sequence, &last, failure)) {
        return false;
    }
    pace->samples_per_s = (double)samples_between(first, last) / (monotonic_s() - first_s);
    return true;
}

unsigned stream_decimation(const stream_pace_t *pace, unsigned signals, double share) {
    const unsigned width = width_of(signals);
    const unsigned frames = width > 0 ? STREAM_FRAME_REGISTERS / width : STREAM_FRAME_REGISTERS;
    const double frames_per_s = share * frames / pace->block_s;
    return (unsigned)fmin(UINT16_MAX, fmax(1.0, ceil(pace->samples_per_s / frames_per_s)));
}
