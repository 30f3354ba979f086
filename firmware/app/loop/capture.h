/* SPDX-License-Identifier: MIT */
/**
 * The recorder: frames of chosen signals that belong together (alignment: loop.h), before and after a trigger.
 *
 * A frame is one register a signal, in the order of the CAPTURE_ bits, each the upper 16 bits of a Q31 number: value =
 * integer / 2^15. The reference is rounded to nearest, drive and position are what the converters got and gave.
 *
 * Armed by the main loop, filled by the sample interrupt, read by the main loop when done. While it waits for a trigger
 * with `before`, the buffer is a ring of the newest frames, and the trigger makes the last of them the beginning. Frame
 * n then lies at place (capture_first() + n) % capacity, where capacity is capture_capacity(signals). A capture that is
 * longer than the buffer goes round in it: it begins at place 0 and is read while it runs. Frame n is whole as long as
 * capture_frames() is below n + capacity afterwards.
 *
 * A capture without end goes round until capture_end (or, as its frames are counted, until there are 2^32 - 1 of them:
 * five days at 10 kHz). capture_read reads frames by their numbers, those of any other capture, too, while it runs and
 * afterwards. Who asks too late, for frames that were overwritten, gets later ones, and sees it by their number.
 */
#ifndef CAPTURE_H
#define CAPTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Values in the buffer: 16,000 frames of two signals. */
#define CAPTURE_WORDS 32000U

/** Register `capture_length`: no end. */
#define CAPTURE_ENDLESS 0U

/** Registers of the block `stream` before its frames. */
#define STREAM_HEADER 10U

/** Bits of the register `capture_signals`. Append only. */
enum {
    CAPTURE_REFERENCE = 1,
    CAPTURE_DRIVE = 2,
    CAPTURE_POSITION = 4,
    CAPTURE_ERROR = 8,       /**< position less reference, saturated */
    CAPTURE_CURRENT = 16,    /**< step of the drive since the sample before */
    CAPTURE_HYSTERESIS = 32, /**< position of the model's hysteresis at the newest drive */
    CAPTURE_TRANSITION = 64, /**< what remains of a transition, saturated */
    CAPTURE_ALL = 127
};

#define CAPTURE_SIGNALS_MOST 7U

/** Chosen after start: reference, drive, position. */
#define CAPTURE_DEFAULT_SIGNALS 7U
#define CAPTURE_FRAME_REGISTERS 3U
#define CAPTURE_CAPACITY        (CAPTURE_WORDS / CAPTURE_FRAME_REGISTERS)

/** Register `capture_state`. */
typedef enum { CAPTURE_IDLE = 0, CAPTURE_ARMED = 1, CAPTURE_RUNNING = 2, CAPTURE_DONE = 3 } capture_state_t;

/** Register `capture_trigger`. */
typedef enum {
    CAPTURE_AT_ONCE = 0,
    CAPTURE_AT_SOURCE = 1,
    CAPTURE_AT_LEVEL = 2,
    CAPTURE_AT_FAULT = 3,
    CAPTURE_AT_WARNING = 4
} capture_trigger_t;

typedef struct {
    uint16_t decimation; /**< a frame every so many samples, 1 or more */
    uint16_t length;     /**< frames, or CAPTURE_ENDLESS */
    uint16_t before;     /**< at most so many of them before the trigger */
    uint16_t signals;    /**< CAPTURE_ bits, at least one */
    int16_t level;       /**< with CAPTURE_AT_LEVEL, of the first signal */
    capture_trigger_t trigger;
} capture_settings_t;

/** Frames that the buffer holds, of these signals. */
uint16_t capture_capacity(uint16_t signals);

/** Can it be armed so? What has frames before its trigger has an end, and has to fit into the buffer. */
bool capture_settings_valid(const capture_settings_t *settings);

/** Idle, empty. Before the sample interrupt runs. */
void capture_init(void);

/** Main loop, under board_lock: forgets what there was and waits for the trigger. `settings` are valid. */
void capture_arm(const capture_settings_t *settings);

/** Main loop, under board_lock: a source starts, and `delay` samples from the next one on its first value is what the
 * aligned frame shows: that will be frame 0 (without `before`). */
void capture_source_started(uint32_t delay);

/** Main loop, under board_lock: no further frames. A capture that still waits for its trigger is idle then. */
void capture_end(void);

/** Sample interrupt, before this sample's frame: a fault or a warning came, CAPTURE_AT_FAULT or CAPTURE_AT_WARNING. */
void capture_event(capture_trigger_t event);

/** Sample interrupt, each sample: where this sample's frame goes, or NULL when there is none. What was written there is
 * completed with capture_taken, which wants to know where the frame ends. Constant time. */
uint16_t *capture_due(uint16_t *signals);
void capture_taken(uint16_t *end);

/** Any context. */
capture_state_t capture_state(void);
uint16_t capture_frames(void);

/** Main loop: place of frame 0. */
uint16_t capture_first(void);

/** A capture of these settings that is armed or running: may the block be read? */
bool capture_readable_while_filled(const capture_settings_t *settings);

/** Main loop: may the block be read? Not while a capture that fits into the buffer is armed or running. */
bool capture_readable(void);

/** How far the newest capture is. */
typedef struct {
    uint16_t number;              /**< captures armed since start, wraps */
    uint16_t decimation, signals; /**< its settings */
    uint16_t width;               /**< registers of a frame */
    uint32_t written;             /**< frames */
    uint32_t age;                 /**< while it runs: samples since the newest frame's */
} capture_progress_t;

/** Main loop, under board_lock. */
capture_progress_t capture_progress(void);

/** Main loop: copies frame *from and those that follow it, as far as they are written, at most so many. When frame
 * *from was overwritten, or is while it is copied, goes on with the newer half of the buffer, and *from becomes the
 * number of the frame that the copy begins with. Returns how many it copied. */
uint16_t capture_read(uint32_t *from, uint16_t most, uint16_t to[]);

/** Main loop: register `index` of the block. */
uint16_t capture_register(size_t index);

#endif
