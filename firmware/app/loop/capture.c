/* SPDX-License-Identifier: MIT */
#include "loop/capture.h"
#include "board.h"

static uint16_t buffer[CAPTURE_WORDS];

static struct {
    capture_settings_t settings;
    capture_state_t state;
    uint32_t todo;        /* frames that are still to come once it runs, from `length` down to 0 */
    uint32_t width;       /* registers of a frame */
    uint16_t *next, *end; /* where the next frame goes, and where the last one that fits into the buffer ends */
    uint32_t first;       /* where frame 0 is */
    uint32_t history;     /* frames since it was armed, at most `most_history` */
    uint32_t most_history;
    bool keeping; /* frames are kept while armed */
    bool triggered;
    bool below;      /* the last frame's first signal was below the level */
    uint32_t delay;  /* samples to let pass after the trigger */
    uint32_t left;   /* samples until the next frame */
    uint32_t length; /* frames; without end the most that can be counted */
    uint16_t number;
} capture;

static uint32_t width_of(uint16_t signals) {
    uint32_t width = 0;
    for (uint32_t rest = signals; rest != 0; rest &= rest - 1U) {
        width++;
    }
    return width;
}

uint16_t capture_capacity(uint16_t signals) {
    const uint32_t width = width_of(signals);
    return (uint16_t)(width > 0 ? CAPTURE_WORDS / width : 0U);
}

bool capture_settings_valid(const capture_settings_t *settings) {
    const bool history = settings->before > 0 || settings->trigger == CAPTURE_AT_LEVEL;
    if (settings->length == CAPTURE_ENDLESS) {
        return !history;
    }
    return settings->before < settings->length && (!history || settings->length <= capture_capacity(settings->signals));
}

void capture_init(void) {
    capture.state = CAPTURE_IDLE;
    capture.length = capture.todo = 0;
    capture.first = 0;
    capture.width = CAPTURE_FRAME_REGISTERS;
    capture.next = buffer;
    capture.end = buffer + CAPTURE_CAPACITY * CAPTURE_FRAME_REGISTERS;
    capture.number = 0;
    capture.settings = (capture_settings_t){.decimation = 1, .length = 1, .signals = CAPTURE_DEFAULT_SIGNALS};
}

void capture_arm(const capture_settings_t *settings) {
    const uint32_t before = settings->before;
    capture.settings = *settings;
    capture.length = settings->length == CAPTURE_ENDLESS ? UINT32_MAX : settings->length;
    capture.todo = capture.length;
    capture.width = width_of(settings->signals);
    capture.end = buffer + capture_capacity(settings->signals) * capture.width;
    capture.next = buffer;
    capture.first = 0;
    capture.keeping = before > 0 || settings->trigger == CAPTURE_AT_LEVEL;
    capture.history = 0;
    /* The frame that crosses a level is known only when it is there, and is no history. */
    capture.most_history = settings->trigger == CAPTURE_AT_LEVEL ? before + 1U : before;
    capture.below = false;
    capture.triggered = settings->trigger == CAPTURE_AT_ONCE;
    capture.delay = 0;
    capture.left = 1; /* the first sample is a frame */
    capture.number++;
    capture.state = CAPTURE_ARMED;
}

void capture_end(void) {
    if (capture.state == CAPTURE_ARMED) {
        capture.state = CAPTURE_IDLE;
    } else if (capture.state == CAPTURE_RUNNING) {
        capture.state = CAPTURE_DONE;
    }
}

void capture_source_started(uint32_t delay) {
    if (capture.state == CAPTURE_ARMED && capture.settings.trigger == CAPTURE_AT_SOURCE && !capture.triggered) {
        capture.triggered = true;
        capture.delay = delay;
    }
}

void capture_event(capture_trigger_t event) {
    if (capture.state == CAPTURE_ARMED && capture.settings.trigger == event) {
        capture.triggered = true;
    }
}

/* From here on frames count; those of the history come first. */
static void begin(void) {
    const uint32_t back = capture.history * capture.width;
    const uint32_t place = (uint32_t)(capture.next - buffer);
    capture.first = place >= back ? place - back : place + (uint32_t)(capture.end - buffer) - back;
    capture.todo = capture.length - capture.history;
    capture.state = capture.history < capture.length ? CAPTURE_RUNNING : CAPTURE_DONE;
}

/* Armed: whether this sample may be a frame. */
static bool waits_with_frames(void) {
    if (!capture.triggered) {
        return capture.keeping;
    }
    if (capture.delay > 0) {
        capture.delay--;
        return capture.keeping;
    }
    begin();
    return capture.state == CAPTURE_RUNNING;
}

uint16_t *capture_due(uint16_t *signals) {
    const capture_state_t state = capture.state;
    if (state != CAPTURE_RUNNING && (state != CAPTURE_ARMED || !waits_with_frames())) {
        return NULL;
    }
    if (capture.left > 1) {
        capture.left--;
        return NULL;
    }
    capture.left = capture.settings.decimation;
    *signals = capture.settings.signals;
    return capture.next;
}

/* A frame that came while armed. */
static void remember(int16_t first_signal) {
    if (capture.history < capture.most_history) {
        capture.history++;
    }
    if (capture.settings.trigger == CAPTURE_AT_LEVEL) {
        const bool below = first_signal < capture.settings.level;
        if (capture.below && !below) {
            begin();
        }
        capture.below = below;
    }
}

void capture_taken(uint16_t *end) {
    const uint16_t *frame = capture.next;
    capture.next = end == capture.end ? buffer : end;
    if (capture.state == CAPTURE_ARMED) {
        remember((int16_t)*frame);
        return;
    }
    capture.todo--;
    if (capture.todo == 0) {
        capture.state = CAPTURE_DONE;
    }
}

capture_state_t capture_state(void) {
    return *(volatile capture_state_t *)&capture.state; /* one word or byte: read whole, and again each time */
}

/* One word changes while it runs, and is read whole. */
static uint32_t frames(void) {
    return capture.length - *(volatile uint32_t *)&capture.todo;
}

uint16_t capture_frames(void) {
    return (uint16_t)frames();
}

uint16_t capture_first(void) {
    return (uint16_t)(*(volatile uint32_t *)&capture.first / capture.width);
}

bool capture_readable_while_filled(const capture_settings_t *settings) {
    return settings->length > capture_capacity(settings->signals);
}

bool capture_readable(void) {
    const capture_state_t state = capture_state();
    const bool filling = state == CAPTURE_ARMED || state == CAPTURE_RUNNING;
    return !filling || capture_readable_while_filled(&capture.settings);
}

capture_progress_t capture_progress(void) {
    return (capture_progress_t){.number = capture.number,
                                .decimation = capture.settings.decimation,
                                .signals = capture.settings.signals,
                                .width = (uint16_t)capture.width,
                                .written = frames(),
                                .age = capture.settings.decimation - capture.left};
}

/* Frame `from` is `behind` frames before the next one. */
static void copy_frames(const uint16_t *next, uint32_t behind, uint16_t count, uint16_t to[]) {
    const uint32_t length = (uint32_t)(capture.end - buffer);
    uint32_t at = ((uint32_t)(next - buffer) + length - behind * capture.width) % length;
    for (uint32_t i = 0; i < count * capture.width; i++) {
        to[i] = ((const volatile uint16_t *)buffer)[at];
        at = at + 1U < length ? at + 1U : 0;
    }
}

uint16_t capture_read(uint32_t *from, uint16_t most, uint16_t to[]) {
    const uint32_t capacity = (uint32_t)(capture.end - buffer) / capture.width;
    for (;;) {
        const uint32_t key = board_lock();
        const uint32_t written = frames();
        const uint16_t *const next = capture.next;
        board_unlock(key);
        if (*from >= written) {
            return 0; /* it is yet to come */
        }
        uint32_t behind = written - *from;
        if (behind > capacity) {
            behind = capacity / 2U;
            *from = written - behind;
        }
        const uint16_t count = (uint16_t)(behind < most ? behind : most);
        copy_frames(next, behind, count, to);
        /* Once more at most: while one block is copied, half a buffer is not written. */
        if (frames() - *from <= capacity) {
            return count;
        }
    }
}

uint16_t capture_register(size_t index) {
    return buffer[index];
}
