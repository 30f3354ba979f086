/* SPDX-License-Identifier: MIT */
#include "capture.h"

static uint16_t buffer[CAPTURE_CAPACITY][CAPTURE_FRAME_REGISTERS];

static struct {
    capture_settings_t settings;
    volatile capture_state_t state;
    volatile uint16_t frames;
    bool triggered;
    uint32_t delay;  /* samples to let pass after the trigger */
    uint16_t passed; /* samples since the last frame */
} capture;

void capture_init(void) {
    capture.state = CAPTURE_IDLE;
    capture.frames = 0;
}

void capture_arm(const capture_settings_t *settings) {
    capture.settings = *settings;
    capture.frames = 0;
    capture.triggered = settings->trigger == CAPTURE_AT_ONCE;
    capture.delay = 0;
    capture.passed = (uint16_t)(settings->decimation - 1U); /* the first sample is a frame */
    capture.state = CAPTURE_ARMED;
}

void capture_source_started(uint32_t delay) {
    if (capture.state == CAPTURE_ARMED && !capture.triggered) {
        capture.triggered = true;
        capture.delay = delay;
    }
}

static void store(const capture_frame_t *frame) {
    uint16_t *to = buffer[capture.frames % CAPTURE_CAPACITY];
    to[0] = (uint16_t)frame->reference;
    to[1] = (uint16_t)frame->drive;
    to[2] = (uint16_t)frame->position;
    capture.frames++;
    if (capture.frames == capture.settings.length) {
        capture.state = CAPTURE_DONE;
    }
}

void capture_sample(const capture_frame_t *frame) {
    if (capture.state == CAPTURE_ARMED && capture.triggered) {
        if (capture.delay > 0) {
            capture.delay--;
        } else {
            capture.state = CAPTURE_RUNNING;
        }
    }
    if (capture.state != CAPTURE_RUNNING) {
        return;
    }
    capture.passed++;
    if (capture.passed == capture.settings.decimation) {
        capture.passed = 0;
        store(frame);
    }
}

capture_state_t capture_state(void) {
    return capture.state;
}

uint16_t capture_frames(void) {
    return capture.frames;
}

bool capture_readable(void) {
    const bool filling = capture.state == CAPTURE_ARMED || capture.state == CAPTURE_RUNNING;
    return !filling || capture.settings.length > CAPTURE_CAPACITY;
}

uint16_t capture_register(size_t index) {
    return buffer[index / CAPTURE_FRAME_REGISTERS][index % CAPTURE_FRAME_REGISTERS];
}
