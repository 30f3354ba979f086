/* SPDX-License-Identifier: MIT */
/**
 * The capture buffer: frames of reference, drive and position that belong together (alignment: loop.h).
 *
 * A frame is three registers, each the upper 16 bits of a Q31 number: value = integer / 2^15. The reference is rounded
 * to nearest, drive and position are what the converters got and gave.
 *
 * Armed by the main loop, filled by the sample interrupt, read by the main loop when done. A capture that is longer
 * than the buffer goes round in it: frame n lies at place n % CAPTURE_CAPACITY, is read while the capture runs, and is
 * whole as long as capture_frames() is below n + CAPTURE_CAPACITY afterwards.
 */
#ifndef CAPTURE_H
#define CAPTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define CAPTURE_CAPACITY        8192U
#define CAPTURE_FRAME_REGISTERS 3U

/** Register `capture_state`. */
typedef enum { CAPTURE_IDLE = 0, CAPTURE_ARMED = 1, CAPTURE_RUNNING = 2, CAPTURE_DONE = 3 } capture_state_t;

/** Register `capture_trigger`. */
typedef enum { CAPTURE_AT_ONCE = 0, CAPTURE_AT_SOURCE = 1 } capture_trigger_t;

typedef struct {
    uint16_t decimation; /**< a frame every so many samples, 1 or more */
    uint16_t length;     /**< frames, 1 or more */
    capture_trigger_t trigger;
} capture_settings_t;

/** All in converter codes with the sign made plain: [-2^15, 2^15) is [-1, 1). */
typedef struct {
    int16_t reference, drive, position;
} capture_frame_t;

/** Idle, empty. Before the sample interrupt runs. */
void capture_init(void);

/** Main loop, under board_lock: forgets what there was and waits for the trigger. */
void capture_arm(const capture_settings_t *settings);

/** Main loop, under board_lock: a source starts, and `delay` samples from the next one on its first value is what the
 * aligned frame shows: that will be frame 0. */
void capture_source_started(uint32_t delay);

/** Sample interrupt, each sample. */
void capture_sample(const capture_frame_t *frame);

/** Any context. */
capture_state_t capture_state(void);
uint16_t capture_frames(void);

/** Main loop: may the block be read? Not while a capture that fits into the buffer is armed or running. */
bool capture_readable(void);

/** Main loop: register `index` of the block. */
uint16_t capture_register(size_t index);

#endif
