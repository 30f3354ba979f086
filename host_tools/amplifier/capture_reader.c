/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/capture_reader.h"
#include "base/progress.h"
#include "loop/capture.h"
#include <stdlib.h>

#define FRAMES_AT_ONCE 256U

capture_reader_t capture_reader(device_t *device, size_t frames) {
    return (capture_reader_t){
        .device = device, .frames = frames, .registers = allocate(CAPTURE_FRAME_REGISTERS * frames, sizeof(uint16_t))};
}

void capture_reader_free(capture_reader_t *reader) {
    free(reader->registers);
    *reader = (capture_reader_t){0};
}

static size_t capacity(const capture_reader_t *reader) {
    return (size_t)device_identity(reader->device, INDEX_capture_capacity);
}

bool capture_reader_streams(const capture_reader_t *reader) {
    return reader->frames > capacity(reader);
}

/* Frame n is whole if the capture had not come to n + capacity when it had been read (capture.h). */
static bool still_whole(capture_reader_t *reader, failure_t *failure) {
    int64_t captured;
    if (!device_read(reader->device, INDEX_capture_frames, &captured, failure)) {
        return false;
    }
    return (size_t)captured < reader->done + capacity(reader) ||
           fail(failure,
                "the line is too slow: frame %zu of the capture was overwritten before it was read; give a higher "
                "--baud, or record less at once",
                reader->done);
}

bool capture_reader_some(capture_reader_t *reader, size_t captured, failure_t *failure) {
    if (captured > reader->frames || captured < reader->done) {
        return fail(failure,
                    "the amplifier says that it has captured %zu frames of %zu, of which %zu were read: that cannot be",
                    captured, reader->frames, reader->done);
    }
    const size_t place = reader->done % capacity(reader);
    size_t count = captured - reader->done;
    count = count < FRAMES_AT_ONCE ? count : FRAMES_AT_ONCE;
    count = count < capacity(reader) - place ? count : capacity(reader) - place;
    if (count == 0) {
        return true;
    }
    if (!device_read_block(reader->device, ADDRESS_capture, CAPTURE_FRAME_REGISTERS * place,
                           CAPTURE_FRAME_REGISTERS * count, reader->registers + CAPTURE_FRAME_REGISTERS * reader->done,
                           failure) ||
        (capture_reader_streams(reader) && !still_whole(reader, failure))) {
        return false;
    }
    reader->done += count;
    return true;
}

bool capture_reader_rest(capture_reader_t *reader, failure_t *failure) {
    progress_t progress;
    progress_begin(&progress, "reading the capture");
    bool ok = true;
    while (ok && reader->done < reader->frames) {
        progress_update(&progress, (double)reader->done / (double)reader->frames);
        ok = capture_reader_some(reader, reader->frames, failure);
    }
    progress_end(&progress);
    return ok;
}
