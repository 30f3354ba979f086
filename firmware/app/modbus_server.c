/* SPDX-License-Identifier: MIT */
/* From bytes to frames. What a frame means is in modbus_requests.c. */
#include "modbus_server.h"
#include "board.h"
#include <stdatomic.h>

/* Longer than two frames, so that the main loop may be busy with one while the next arrives. A power of two. */
#define RING_ITEMS 1024U

/* An item of the ring is a byte and what was before it. */
enum { ITEM_AFTER_SILENCE = 0x100, ITEM_BROKEN = 0x200 };

/* One writer, the interrupt, and one reader, the main loop. */
static struct {
    uint16_t items[RING_ITEMS];
    atomic_uint written, read; /* item counts, wrapping; each side stores its own */
    atomic_uint last_time;     /* of the last byte, microseconds */
    uint16_t carried;          /* interrupt only: flags of items that found no room */
} ring;

/* The frame that is being put together. Main loop only. (An array of its own, so that the sanitizers guard its end.) */
static uint8_t frame_bytes[MODBUS_FRAME_MAX];
static struct {
    size_t length;
    bool started;
    bool broken;
} frame;

static modbus_counters_t counters;
static uint32_t last_request;

static void push(uint16_t item) {
    const uint32_t now = board_microseconds();
    const uint32_t last = atomic_load_explicit(&ring.last_time, memory_order_relaxed);
    if (now - last > board_info.modbus_silence_us) {
        item |= ITEM_AFTER_SILENCE;
    }
    item |= ring.carried;
    const unsigned written = atomic_load_explicit(&ring.written, memory_order_relaxed);
    if (written - atomic_load_explicit(&ring.read, memory_order_acquire) == RING_ITEMS) {
        ring.carried = (uint16_t)((item & ITEM_AFTER_SILENCE) | ITEM_BROKEN);
    } else {
        ring.carried = 0;
        ring.items[written % RING_ITEMS] = item;
        atomic_store_explicit(&ring.written, written + 1U, memory_order_release);
    }
    atomic_store_explicit(&ring.last_time, now, memory_order_release);
}

void modbus_server_receive(uint8_t byte) {
    push(byte);
}

void modbus_server_line_error(void) {
    push(ITEM_BROKEN);
}

static bool ring_empty(void) {
    return atomic_load_explicit(&ring.written, memory_order_acquire) ==
           atomic_load_explicit(&ring.read, memory_order_relaxed);
}

static uint16_t pop(void) {
    const unsigned read = atomic_load_explicit(&ring.read, memory_order_relaxed);
    const uint16_t item = ring.items[read % RING_ITEMS];
    atomic_store_explicit(&ring.read, read + 1U, memory_order_release);
    return item;
}

void modbus_server_init(void) {
    atomic_store(&ring.written, 0);
    atomic_store(&ring.read, 0);
    atomic_store(&ring.last_time, board_microseconds());
    ring.carried = 0;
    frame.started = false;
    last_request = board_microseconds();
    modbus_server_clear();
}

static void count(uint16_t *counter) {
    if (*counter < UINT16_MAX) {
        (*counter)++;
    }
}

static void serve_frame(void) {
    uint8_t reply[MODBUS_FRAME_MAX];
    size_t reply_length = 0;
    const modbus_outcome_t outcome =
        frame.broken ? MODBUS_FRAME_BROKEN : modbus_serve(frame_bytes, frame.length, reply, &reply_length);
    frame.started = false;
    if (outcome == MODBUS_FRAME_BROKEN) {
        count(&counters.errors);
    } else if (outcome != MODBUS_FRAME_FOREIGN) {
        last_request = board_microseconds();
    }
    if (outcome == MODBUS_FRAME_ANSWERED) {
        count(&counters.served);
        board_modbus_send(reply, reply_length);
    }
}

/* Appends a byte to the frame, or begins one with it. */
static void take(uint16_t item) {
    if (!frame.started) {
        frame.started = true;
        frame.broken = false;
        frame.length = 0;
    }
    if ((item & ITEM_BROKEN) != 0 || frame.length == MODBUS_FRAME_MAX) {
        frame.broken = true;
    } else {
        frame_bytes[frame.length++] = (uint8_t)item;
    }
}

bool modbus_server_poll(void) {
    bool any = false;
    while (!ring_empty()) {
        const uint16_t item = pop();
        if (frame.started && (item & ITEM_AFTER_SILENCE) != 0) {
            serve_frame();
            any = true;
        }
        take(item);
    }
    /* The order matters. A byte that arrives before the last look at the ring is seen there; one that arrives after it
     * is later than `now`, so it carries the mark of the silence itself. */
    const uint32_t last = atomic_load_explicit(&ring.last_time, memory_order_acquire);
    const uint32_t now = board_microseconds();
    if (frame.started && now - last > board_info.modbus_silence_us && ring_empty()) {
        serve_frame();
        any = true;
    }
    return any;
}

uint32_t modbus_server_last_request(void) {
    return last_request;
}

modbus_counters_t modbus_server_counters(void) {
    return counters;
}

void modbus_server_clear(void) {
    counters = (modbus_counters_t){0};
}
