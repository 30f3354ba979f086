/* SPDX-License-Identifier: MIT */
/**
 * What the application asks of a board. Each folder under firmware/boards implements this, and nothing outside it
 * touches a chip register. The native test build implements it in tests/firmware.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Constants of the board. */
typedef struct {
    uint16_t id;              /**< register `board` */
    uint16_t latency_samples; /**< register `latency` */
    uint16_t position_bits, drive_bits;
    uint32_t sample_rate_mhz;
    uint32_t cost_rate_hz;      /**< counts per second of board_cost_counter */
    uint32_t modbus_silence_us; /**< t3.5: silence that ends a frame */
} board_info_t;

extern const board_info_t board_info;

/** Clocks (waits are bounded; on a timeout the board goes on with what it has), pins, converters, serial line. Returns
 * fault bits (clock fallback). */
uint16_t board_init(void);

/** Starts the sample interrupt, which calls loop_sample(). From then on every sample writes a drive code. */
void board_start(void);

/** Free-running counters, wrap-around. Any context. */
uint32_t board_cost_counter(void);
uint32_t board_microseconds(void);

/** Sends a frame on the Modbus line; takes a copy or blocks until it is out; handles the RS-485 driver enable. Main
 * loop only. */
void board_modbus_send(const uint8_t *frame, size_t length);

/** Main loop is idle: wait for an interrupt. */
void board_idle(void);

/** Interrupt lock for the few words that the main loop shares with the sample interrupt. */
uint32_t board_lock(void);
void board_unlock(uint32_t key);

#endif
