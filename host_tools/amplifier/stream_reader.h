/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Reads the frames of the newest capture by their numbers, while it runs: of one without end as a stream.
 *
 * The amplifier says with each block which frame it begins with. A frame that was overwritten before it was read is
 * therefore always noticed (stream_block_t.lost), and so is a capture that was armed anew (restarted): its frames are
 * read from the first one on. A request whose answer was lost is repeated, and loses nothing.
 *
 * Limitations. The frames are those that the decimation leaves: what is above half their rate is aliased, as in every
 * recording of the amplifier. There is one recorder: a stream and a triggered capture at the same time there cannot be.
 */
#ifndef STREAM_READER_H
#define STREAM_READER_H

#include "amplifier/device/device.h"
#include "loop/capture.h"

/** Registers of a block's frames. */
#define STREAM_FRAME_REGISTERS (LENGTH_stream - STREAM_HEADER)

typedef struct {
    device_t *device;
    bool begun;
    uint16_t number; /**< of the capture */
    uint32_t next;   /**< frame that is read next */
    bool timed;
    uint32_t sample; /**< the loop's sample of frame 0, once timed */
} stream_reader_t;

typedef struct {
    bool restarted;  /**< the capture is another one than that of the block before */
    uint32_t lost;   /**< frames that were overwritten before they were read, and lie before these */
    uint32_t first;  /**< number of the first of these frames, wraps */
    size_t frames;   /**< 0: there are no new ones */
    uint32_t behind; /**< frames that are written and not read yet, after these */
    uint32_t sample; /**< the loop's sample of the first of these frames. Holds if the capture still ran when its first
                        block was read */
    unsigned decimation, signals, width;
    uint16_t value[STREAM_FRAME_REGISTERS]; /**< width registers a frame, in the order of the CAPTURE_ bits */
} stream_block_t;

/** Arms a capture without end of these signals (CAPTURE_ bits), which starts at once or with the source. Unlocks the
 * parameters of the amplifier for it. */
bool stream_arm(device_t *device, unsigned signals, unsigned decimation, capture_trigger_t trigger, failure_t *failure);

/** Reads the next block. */
bool stream_read(stream_reader_t *reader, stream_block_t *block, failure_t *failure);

/** What the line carries, and has to. */
typedef struct {
    double block_s;       /**< it takes for one block: the longest of a few */
    double samples_per_s; /**< of the loop, by the clock here: an emulated one is slower than it says */
} stream_pace_t;

/** Measures it. */
bool stream_measure(device_t *device, stream_pace_t *pace, failure_t *failure);

/** The smallest decimation with which this share of the line carries all frames of these signals. */
unsigned stream_decimation(const stream_pace_t *pace, unsigned signals, double share);

#endif
