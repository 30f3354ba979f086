/* SPDX-License-Identifier: MIT */
/**
 * A board that is made of variables, so that the application runs natively: time stands still unless the test moves it.
 */
#ifndef TESTS_FAKE_BOARD_H
#define TESTS_FAKE_BOARD_H

#include "board.h"
#include "hyst/fixed.h"

enum { FAKE_LATENCY = 2, FAKE_SAMPLE_US = 100, FAKE_SAMPLED_AFTER_NS = 97000, FAKE_SILENCE_US = 1750 };

/* As the h405 has them. */
#define FAKE_DRIVE_SLEW_MAX      BOARD_RANGE_IN_US(800, 1000000U / FAKE_SAMPLE_US)
#define FAKE_TRANSITION_SLEW_MIN BOARD_RANGE_IN_US(10000000, 1000000U / FAKE_SAMPLE_US)
#define FAKE_TRANSITION_SLEW_MAX BOARD_RANGE_IN_US(10000, 1000000U / FAKE_SAMPLE_US)
#define FAKE_FAULT_SLEW_MIN      BOARD_RANGE_IN_US(500000, 1000000U / FAKE_SAMPLE_US)
#define FAKE_FILTER_GAIN_MAX     64
#define FAKE_SAFE_CODE           0U

/** After fake_board_power_on. */
#define FAKE_SERIAL                                                                                                    \
    { 0x00440055, 0x3332470F, 0x20313937 }

typedef struct {
    uint32_t microseconds;
    uint32_t cost;           /**< what board_cost_counter says */
    uint32_t cost_per_look;  /**< and how much more at each look */
    unsigned locks;          /**< depth of board_lock */
    void (*interrupt)(void); /**< comes right before each lock of the main loop, and right behind it; NULL: none */
    uint8_t sent[256];       /**< last frame on the Modbus line */
    size_t sent_length;
    unsigned frames_sent;
    uint32_t baud;
    line_parity_t parity;
    unsigned frames_before_line; /**< frames_sent when the line was last set */
    bool stage_enabled;
    uint16_t kept_park;    /**< board_keep_park */
    unsigned watchdog_fed; /**< how often */
    bool main_stalls;      /**< the main loop makes no turn between two samples */
    int32_t health[HEALTH_CHANNELS];
    bool output_stuck; /**< what board_output_follows denies */
} fake_board_t;

/** Readings after fake_board_start, within FAKE_HEALTH. */
enum { FAKE_TEMPERATURE = 35000, FAKE_SUPPLY = 3300, FAKE_HIGH_VOLTAGE = 160000 };
#define FAKE_HEALTH                                                                                                    \
    { 70000, 80000, 3000, 3600, 150000, 170000 }

extern fake_board_t fake_board;

/** Clock of the processor, which a power-on leaves as it is. 168 MHz unless a test changes it. */
extern uint32_t fake_core_hz;

/** Called with each frame that is sent, when it is set. */
extern void (*fake_board_sends)(const uint8_t *frame, size_t length);

/* FAKE_CONVERTER_BITS and FAKE_ENDS_AT_LENGTH come from CMakeLists.txt. */

/** Its flash sectors, which keep what they hold over fake_board_start. */
typedef struct {
    uint32_t words[BOARD_STORE_SECTORS][BOARD_STORE_WORDS];
    unsigned erasures;
    unsigned steps_left; /**< until the supply goes; only while cutting */
    bool cutting, dead;
    bool stuck; /**< stuck_word takes nothing */
    size_t stuck_word;
    void (*after_each_step)(void); /**< what happens while the flash is busy; NULL: nothing */
} fake_store_t;

extern fake_store_t fake_store;

/** Erased, as delivered. */
void fake_store_clear(void);

/** The supply goes in the middle of the erase or program step number `steps` from now on; nothing is written after it.
 * `random`, for what is half done then. */
void fake_store_cut_after(unsigned steps, uint32_t (*random)(void));

/** The supply comes back. Returns whether it was gone. */
bool fake_store_power_on(void);

/** Power-on: everything zero, then amplifier_init. Off, without an image, locked. */
void fake_board_start_locked(const board_start_t *start);

/** The same, and unlocked. */
void fake_board_start(const board_start_t *start);

/** The same, and what a master does before it works: commits the default image, which is parked in the middle, takes
 * the communication timeout away, arms and waits until the amplifier holds. Then clears the counters. */
void fake_board_power_on(uint16_t faults);

/** Commits of fake_board_power_on, and the samples it takes. */
enum { FAKE_COMMITS = 1, FAKE_SAMPLES = 3000 };

/** One sample period passes: the sample interrupt. Returns the drive code. */
uint16_t fake_board_sample(hyst_q31_t position);

/** The same as a Q31 number. */
hyst_q31_t fake_board_drive(hyst_q31_t position);

/** `count` samples at position 0. Returns the last drive. */
hyst_q31_t fake_board_run(unsigned count);

/** May amplifier state `after` follow on `before`, whatever anybody writes and whatever fails? `command`: one that was
 * taken since, 0 none; `tripped`: something may have. */
bool fake_board_lawful(uint32_t before, uint32_t after, uint32_t command, bool tripped);

#endif
