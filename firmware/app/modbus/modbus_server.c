/* SPDX-License-Identifier: MIT */
/* From bytes to frames. What a frame means is in modbus_requests.c. */
#include "modbus/modbus_server.h"
#include "board.h"
#include <stdatomic.h>
#include <string.h>

/* Longer than two frames, so that the main loop may be busy with one while the next arrives. A power of two. */
#define RING_ITEMS 1024U

/* An item of the ring is a byte and what was before it. */
enum {
    ITEM_AFTER_SILENCE = 0x100,
    ITEM_BROKEN = 0x200,
    ITEM_AFTER_ANSWER = 0x400,
    ITEM_WITHIN_ANSWER = 0x800,
    ITEM_LATE = 0x1000 /* and a silence behind the answer's end: as a master has it */
};
#define ITEM_MARKS ((unsigned)ITEM_AFTER_SILENCE | ITEM_AFTER_ANSWER | ITEM_WITHIN_ANSWER | ITEM_LATE)

/* So many answers in a row that did not come back: the line has no echo. One that came back shows that it has. */
#define ANSWERS_WITHOUT_ECHO 4U

/* One writer, the interrupt, and one reader, the main loop. */
static struct {
    uint16_t items[RING_ITEMS];
    atomic_uint written, read; /* item counts, wrapping; each side stores its own */
    atomic_uint last_time;     /* of the last byte, microseconds */
    uint16_t carried;          /* interrupt only: flags of items that found no room */
} ring;

/* The frame that is being put together. Main loop only. (A separate array, so that the sanitizers guard its end.) */
static uint8_t frame_bytes[MODBUS_FRAME_MAX];
static struct {
    size_t length;
    bool started;
    bool broken;
    bool after_answer;  /* began so soon after an answer that it may be its echo */
    bool within_answer; /* or while it was being sent: it is no request */
    bool late;          /* or a silence behind it, where a master repeats a request */
    bool repeats;       /* taken for a request, and may be an echo all the same */
    bool judges;        /* the first one after an answer, and no copy of it */
} frame;

/* The last answer. The main loop writes all but `sending`, which the interrupt reads. */
static uint8_t answer_bytes[MODBUS_FRAME_MAX];
static struct {
    size_t length;        /* 0 when no frame can be its echo any more */
    unsigned unreturned;  /* in a row, at most ANSWERS_WITHOUT_ECHO */
    bool returns_late;    /* one that is no request came back a silence behind it */
    atomic_bool expected; /* it is being sent, or has been since the last frame */
    atomic_bool sending;
    atomic_uint sent_time; /* microseconds */
} answer;

static modbus_counters_t counters;

/* In force, and what it is to become. Main loop only, but for the times. */
static struct {
    line_settings_t now, next;
    bool changes;
    atomic_uint silence_us, gap_us;
} line;

static uint32_t silence_us(void) {
    return atomic_load_explicit(&line.silence_us, memory_order_relaxed);
}
static uint32_t accepted;

static bool being_answered(void) {
    return atomic_load_explicit(&answer.sending, memory_order_acquire);
}

static uint32_t since_answer(uint32_t now) {
    return now - atomic_load_explicit(&answer.sent_time, memory_order_acquire);
}

/* Two silences: modbus_server.h. */
static bool may_be_echo(uint32_t now) {
    if (!atomic_load_explicit(&answer.expected, memory_order_acquire)) {
        return false;
    }
    return being_answered() || since_answer(now) <= 2U * silence_us();
}

/* Of an item that may be an echo's. By the ends of bytes and by this clock a master's first byte is always late, as it
 * is always after a silence: line_gap_us. */
static unsigned answer_marks(uint32_t now) {
    if (being_answered()) {
        return ITEM_AFTER_ANSWER | ITEM_WITHIN_ANSWER;
    }
    const bool late = since_answer(now) > atomic_load_explicit(&line.gap_us, memory_order_relaxed);
    return late ? ITEM_AFTER_ANSWER | ITEM_LATE : ITEM_AFTER_ANSWER;
}

static void push(uint16_t item) {
    const uint32_t now = board_microseconds();
    if (may_be_echo(now)) {
        item |= (uint16_t)answer_marks(now);
    }
    const uint32_t last = atomic_load_explicit(&ring.last_time, memory_order_relaxed);
    if (now - last > atomic_load_explicit(&line.gap_us, memory_order_relaxed)) {
        item |= ITEM_AFTER_SILENCE;
    }
    item |= ring.carried;
    const unsigned written = atomic_load_explicit(&ring.written, memory_order_relaxed);
    if (written - atomic_load_explicit(&ring.read, memory_order_acquire) == RING_ITEMS) {
        ring.carried = (uint16_t)((item & ITEM_MARKS) | ITEM_BROKEN);
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

static void set_line(const line_settings_t *settings) {
    line.now = *settings;
    line.changes = false;
    atomic_store(&line.silence_us, line_silence_us(settings->baud));
    atomic_store(&line.gap_us, line_gap_us(settings->baud));
    board_modbus_line(settings->baud, (line_parity_t)settings->parity);
}

void modbus_server_change_line(const line_settings_t *settings) {
    line.next = *settings;
    line.changes = true;
}

void modbus_server_take_line(void) {
    if (line.changes) {
        set_line(&line.next);
    }
}

uint32_t modbus_server_address(void) {
    return line.now.address;
}

void modbus_server_init(const line_settings_t *settings) {
    set_line(settings);
    atomic_store(&ring.written, 0);
    atomic_store(&ring.read, 0);
    atomic_store(&ring.last_time, board_microseconds());
    ring.carried = 0;
    frame.started = false;
    answer.length = 0;
    answer.unreturned = 0;
    answer.returns_late = false;
    atomic_store(&answer.expected, false);
    atomic_store(&answer.sending, false);
    modbus_server_clear();
}

static void count(uint16_t *counter) {
    if (*counter < UINT16_MAX) {
        (*counter)++;
    }
}

static void send_answer(void) {
    count(&counters.served);
    atomic_store_explicit(&answer.sending, true, memory_order_release);
    atomic_store_explicit(&answer.expected, true, memory_order_release);
    board_modbus_send(answer_bytes, answer.length);
    atomic_store_explicit(&answer.sent_time, board_microseconds(), memory_order_release);
    atomic_store_explicit(&answer.sending, false, memory_order_release);
}

/* Of a frame that begins with a copy of the answer: whether it can be a request that a master has repeated. */
static bool can_be_request(void) {
    const uint8_t function = answer_bytes[1];
    return !frame.within_answer && (function == 5 || function == 6 || function == 8 || function == 22);
}

/* Whether it is one. A line returns an answer at once, a master waits for a silence first: so the time says it, unless
 * this line is known to return answers as late. What comes sooner is a hasty master's where the line has no echo. */
static bool is_request(void) {
    return answer.unreturned == ANSWERS_WITHOUT_ECHO || (frame.late && !answer.returns_late);
}

/* How many bytes of the frame are the last answer's echo. No later frame can be; but a frame without the mark, while
 * new ones still get it, began before that answer, and the echo may be behind it. */
static size_t echoed(void) {
    const size_t length = answer.length;
    if (!frame.after_answer && may_be_echo(board_microseconds())) {
        return 0;
    }
    answer.length = 0;
    atomic_store_explicit(&answer.expected, false, memory_order_release);
    frame.judges = length > 0;
    if (!frame.after_answer || length == 0 || frame.length < length || memcmp(frame_bytes, answer_bytes, length) != 0) {
        return 0;
    }
    frame.judges = false;
    if (frame.length == length && can_be_request()) {
        frame.repeats = is_request();
        return frame.repeats ? 0 : length;
    }
    answer.unreturned = 0;
    answer.returns_late = frame.late;
    return length;
}

/* By the first frame after an answer, which is no copy of it. Bytes that are no frame may be what is left of an echo,
 * whose beginning was not heard. */
static void judge_line(bool whole) {
    if (!whole && frame.after_answer) {
        answer.unreturned = 0;
    } else if (answer.unreturned < ANSWERS_WITHOUT_ECHO) {
        answer.unreturned++;
    } else {
        answer.returns_late = false;
    }
}

static void serve_frame(void) {
    frame.repeats = frame.judges = false;
    const size_t from = echoed();
    frame.started = false;
    if (from > 0) {
        count(&counters.echoes);
        if (from == frame.length && !frame.broken) {
            return;
        }
    }
    size_t length = 0;
    const modbus_outcome_t outcome = frame.broken
                                         ? MODBUS_FRAME_BROKEN
                                         : modbus_serve(frame_bytes + from, frame.length - from, answer_bytes, &length);
    if (outcome == MODBUS_FRAME_BROKEN) {
        count(&counters.errors);
    } else if ((outcome == MODBUS_FRAME_ANSWERED || outcome == MODBUS_FRAME_BROADCAST) && !frame.repeats) {
        accepted++;
    }
    if (frame.judges) {
        judge_line(outcome != MODBUS_FRAME_BROKEN);
    }
    if (outcome != MODBUS_FRAME_BROKEN && outcome != MODBUS_FRAME_FOREIGN) {
        answer.length = length; /* what was in answer_bytes is no more */
    }
    if (length > 0) {
        send_answer();
    }
    modbus_server_take_line();
}

/* Appends a byte to the frame, or begins one with it. */
static void take(uint16_t item) {
    if (!frame.started) {
        frame.started = true;
        frame.broken = false;
        frame.after_answer = (item & ITEM_AFTER_ANSWER) != 0;
        frame.within_answer = (item & ITEM_WITHIN_ANSWER) != 0;
        frame.late = (item & ITEM_LATE) != 0;
        frame.length = 0;
    }
    if ((item & ITEM_BROKEN) != 0 || frame.length == MODBUS_FRAME_MAX) {
        frame.broken = true;
    } else {
        frame_bytes[frame.length++] = (uint8_t)item;
    }
}

/* Of a frame that nothing follows yet. */
static bool ends_at_length(void) {
    return board_info.modbus_ends_at_length && !frame.broken &&
           frame.length == modbus_request_length(frame_bytes, frame.length) &&
           modbus_crc(frame_bytes, frame.length) == 0;
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
     * is later than `now`, so it carries the mark of the silence itself (the gap is no longer than the silence). */
    const uint32_t last = atomic_load_explicit(&ring.last_time, memory_order_acquire);
    const uint32_t now = board_microseconds();
    if (frame.started && (now - last > silence_us() || ends_at_length()) && ring_empty()) {
        serve_frame();
        any = true;
    }
    return any;
}

uint32_t modbus_server_accepted(void) {
    return accepted;
}

modbus_counters_t modbus_server_counters(void) {
    return counters;
}

void modbus_server_clear(void) {
    counters = (modbus_counters_t){0};
}
