/* SPDX-License-Identifier: MIT */
/**
 * What the application asks of a board, and what it offers to the board's interrupts. Each folder under
 * firmware/boards implements the first, and nothing outside it touches a chip register. The native test build
 * implements it in tests/firmware.
 */
#ifndef BOARD_H
#define BOARD_H

#include "hyst/board_limits.h"
#include "store/line_settings.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** The whole converter range, 2^32, in so many microseconds, as a step per sample. */
#define BOARD_RANGE_IN_US(microseconds, rate_hz)                                                                       \
    ((hyst_q31_t)((UINT64_C(1) << 32) * 1000000U / ((uint64_t)(microseconds) * (rate_hz))))

/** What a board may measure of itself. */
typedef enum { HEALTH_TEMPERATURE, HEALTH_SUPPLY, HEALTH_HIGH_VOLTAGE, HEALTH_CHANNELS } health_channel_t;

/** There is no such sensor, or no reading yet. */
#define HEALTH_ABSENT INT32_MIN

/** Temperatures in 0.001 C, voltages in mV (health_watch.h). */
typedef struct {
    int32_t temperature_alert, temperature_trip;
    int32_t supply_low, supply_high;
    int32_t high_voltage_low, high_voltage_high;
} board_health_limits_t;

/** Constants of the board. */
typedef struct {
    uint16_t id;               /**< register `board` */
    uint16_t latency_samples;  /**< register `latency`; at most BOARD_LATENCY_MAX */
    uint32_t sampled_after_ns; /**< register `sampled_after` */
    uint16_t position_bits, drive_bits;
    uint32_t sample_rate_mhz;
    uint32_t cost_rate_hz;      /**< counts per second of board_cost_counter */
    uint32_t modbus_silence_us; /**< least silence that ends a frame (line_silence_us) */
    bool modbus_ends_at_length; /**< a line that has no bytes of others: modbus_server.h */
    uint16_t safe_code;         /**< drive code without an image, from reset on */
    /** No two drive codes are farther apart than this, whatever makes the drive: a source that starts elsewhere, a new
     * image, a filter, a jump of the reference. What the power stage's current limit and the actuator can stand. */
    hyst_q31_t drive_slew_max;
    /** A fault's ramp to park is no slower than this, whatever the image says: from anywhere it has to be over before a
     * fault does its damage, and before the hardware watchdog bites. */
    hyst_q31_t fault_slew_min;
    hyst_board_limits_t image_limits; /**< what an image may ask for */
    board_health_limits_t health;     /**< after start; a register may narrow them, and does not widen them */
} board_info_t;

#define BOARD_LATENCY_MAX 64U
#define BOARD_CODE_MIDDLE 0x8000U /**< converter code of 0: offset binary, left-aligned to 16 bits */

extern const board_info_t board_info;

/** Bits of the registers `faults_sticky` and `faults_live`. Append only. */
enum {
    FAULT_OVERRUN = 1,
    FAULT_CONVERTER_TIMEOUT = 2,
    FAULT_WATCHDOG = 4,
    FAULT_CLOCK_FALLBACK = 8,
    FAULT_OVERLOAD = 16, /**< overruns in a row */
    FAULT_SUPPLY = 32,   /**< the supply is too low, or outside of its limits */
    FAULT_CURRENT = 64,  /**< the average current is above its limit */
    FAULT_TEMPERATURE = 128,
    FAULT_HIGH_VOLTAGE = 256, /**< the stage's supply is outside of its limits */
    FAULT_IMAGE = 512,        /**< the image in force is not what was committed: memory has changed */
    FAULT_STALL = 1024,       /**< the main loop stands still */
    FAULT_OUTPUT = 2048       /**< the drive's converter does not hold the code that it was given */
};

/** Bits of the register `reset_cause`. Append only. */
enum {
    RESET_POWER = 1,    /**< power came on, or browned out */
    RESET_PIN = 2,      /**< the reset pin, also that of a programmer */
    RESET_WATCHDOG = 4, /**< the hardware watchdog: interrupt or main loop stood still */
    RESET_SOFTWARE = 8, /**< requested by the firmware: after a processor fault */
    RESET_FAULT = 16    /**< a fault record was left: fault_address says where */
};

/** Why the board starts, and what the last run left behind. */
typedef struct {
    uint16_t faults;        /**< FAULT_ bits that stay; FAULT_SUPPLY until a sample finds it high enough */
    uint16_t reset_cause;   /**< RESET_ bits */
    uint16_t starts;        /**< since power came on, this one included */
    uint32_t fault_address; /**< of the instruction that faulted, with RESET_FAULT */
    uint32_t fault_status;  /**< the processor's configurable fault status then */
    uint32_t serial[3];     /**< serial number, highest bits first; zeros: none */
    bool default_line;      /**< somebody asks for LINE_SETTINGS_DEFAULT, whatever is stored: a button, a strap */
} board_start_t;

/** Clocks (waits are bounded; on a timeout the board goes on with what it has), pins, converters, serial line. The
 * stage is off, and so is the output. */
board_start_t board_init(void);

/** Clock of the processor as it really runs, 1 MHz or more: what is in a period (hyst/cost.h). Main loop, after
 * board_init. */
uint32_t board_core_hz(void);

/** Enable line of the power stage. Sample interrupt, each sample. */
void board_stage_enable(bool on);

/** The newest reading, 0.001 C or mV. Sample interrupt, one channel every HEALTH_WATCH_EVERY samples, in turn. Must not
 * wait. */
int32_t board_health(health_channel_t channel);

/** Does the drive's converter hold the code of the last sample? True where it cannot be read back. Sample interrupt,
 * every HEALTH_WATCH_EVERY samples, before this sample's code is written. */
bool board_output_follows(void);

/** Takes the conversion that came to its end, and begins the next one, if that is how the board comes by its readings.
 * Sample interrupt, as often, and some samples before board_health. Must not wait. */
void board_health_convert(void);

/** Feeds the hardware watchdog, where there is one: main loop, when it has seen the sample interrupt run. The sample
 * interrupt while a fault's ramp is under way, and no longer than LOOP_FAULT_FEED_MS. */
void board_watchdog_feed(void);

/** Puts this drive code out, then starts the sample interrupt, which calls loop_sample(). From then on every sample
 * writes a drive code. */
void board_start(uint16_t drive_code);

/** The image in force parks at this drive code. The board keeps it where a processor fault finds it without memory, if
 * it has such a place. Sample interrupt, at an adoption; board_start keeps its own code. */
void board_keep_park(uint16_t drive_code);

/** Free-running counters, wrap-around. Any context. */
uint32_t board_cost_counter(void);
uint32_t board_microseconds(void);

/** Sends a frame on the Modbus line; takes a copy or blocks until it is out; handles the RS-485 driver enable. On a
 * half-duplex line nothing is received meanwhile: it could only be the frame itself. Main loop only. */
void board_modbus_send(const uint8_t *frame, size_t length);

/** Can the line make this rate within 1.5 % (line_divider)? Main loop, after board_init. */
bool board_modbus_baud_possible(uint32_t baud);

/** The line has this rate and parity from now on. Valid settings, nothing being sent; a byte that is arriving is lost.
 * From board_init on it has those of LINE_SETTINGS_DEFAULT. Main loop only. */
void board_modbus_line(uint32_t baud, line_parity_t parity);

/** Main loop is idle: wait for an interrupt. Must come back within about a millisecond even without one, because the
 * end of a Modbus frame is a silence and raises none. */
void board_idle(void);

/** Interrupt lock for the few words that the main loop shares with the sample interrupt. */
uint32_t board_lock(void);
void board_unlock(uint32_t key);

/**
 * The flash sectors of image_store.h: memory that reads as words, is erased to all ones as a whole and programmed a
 * word at a time, once. Both may take long and stall the processor; false when the flash refuses. Main loop only,
 * output off.
 */
#define BOARD_STORE_SECTORS 2U
#define BOARD_STORE_WORDS   768U
const uint32_t *board_store_sector(unsigned sector);
bool board_store_erase(unsigned sector);
bool board_store_program(unsigned sector, size_t word, uint32_t value);

/* Offered to the board's interrupts. The sample interrupt's side is loop.h. */

/** A byte arrived on the Modbus line. One context only: the line's interrupt. Constant time. */
void modbus_server_receive(uint8_t byte);

/** A byte arrived broken (parity, framing, noise) or was lost: the frame it belongs to will be dropped. Same context.
 */
void modbus_server_line_error(void);

#endif
