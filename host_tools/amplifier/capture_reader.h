/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Reads the amplifier's capture: when it is complete, or, if it is longer than the ring buffer, while it runs. */
#ifndef CAPTURE_READER_H
#define CAPTURE_READER_H

#include "amplifier/device/device.h"

typedef struct {
    device_t *device;
    size_t frames;       /**< of the whole capture */
    size_t done;         /**< frames read so far */
    uint16_t *registers; /**< CAPTURE_FRAME_REGISTERS a frame */
} capture_reader_t;

/** To be freed with capture_reader_free. */
capture_reader_t capture_reader(device_t *device, size_t frames);
void capture_reader_free(capture_reader_t *reader);

/** Whether the capture is longer than the buffer. */
bool capture_reader_streams(const capture_reader_t *reader);

/** Reads some of the first `captured` frames that are still unread. False with *failure, also if frames were
 * overwritten before they were read, or if there cannot be so many: `captured` is what the amplifier says. */
bool capture_reader_some(capture_reader_t *reader, size_t captured, failure_t *failure);

/** Reads the rest of a complete capture, and shows progress. */
bool capture_reader_rest(capture_reader_t *reader, failure_t *failure);

#endif
