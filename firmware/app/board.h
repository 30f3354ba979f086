/* SPDX-License-Identifier: MIT */
/**
 * What the application asks of a board, and what it offers to the board's interrupts. Each folder under
 * firmware/boards implements the first, and nothing outside it touches a chip register. The native test build
 * implements it in tests/firmware.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Constants of the board. */
typedef struct {
    uint16_t id;              /**< register `board` */
    uint16_t latency_samples; /**< register `latency`; at most BOARD_LATENCY_MAX */
    uint16_t position_bits, drive_bits;
    uint32_t sample_rate_mhz;
    uint32_t cost_rate_hz;      /**< counts per second of board_cost_counter */
    uint32_t modbus_silence_us; /**< t3.5: silence that ends a frame */
} board_info_t;

#define BOARD_LATENCY_MAX 64U
#define BOARD_CODE_MIDDLE 0x8000U /**< converter code of 0: offset binary, left-aligned to 16 bits */

extern const board_info_t board_info;

/** Bits of the registers `faults_sticky` and `faults_live`. Append only. */
enum { FAULT_OVERRUN = 1, FAULT_CONVERTER_TIMEOUT = 2, FAULT_WATCHDOG = 4, FAULT_CLOCK_FALLBACK = 8 };

/** Clocks (waits are bounded; on a timeout the board goes on with what it has), pins, converters, serial line. Returns
 * FAULT_ bits (clock fallback). */
uint16_t board_init(void);

/** Starts the sample interrupt, which calls loop_sample(). From then on every sample writes a drive code. */
void board_start(void);

/** Free-running counters, wrap-around. Any context. */
uint32_t board_cost_counter(void);
uint32_t board_microseconds(void);

/** Sends a frame on the Modbus line; takes a copy or blocks until it is out; handles the RS-485 driver enable. Main
 * loop only. */
void board_modbus_send(const uint8_t *frame, size_t length);

/** Main loop is idle: wait for an interrupt. Must come back within about a millisecond even without one, because the
 * end of a Modbus frame is a silence and raises none. */
void board_idle(void);

/** Interrupt lock for the few words that the main loop shares with the sample interrupt. */
uint32_t board_lock(void);
void board_unlock(uint32_t key);

/* Offered to the board's interrupts. The sample interrupt's side is loop.h. */

/** A byte arrived on the Modbus line. One context only: the line's interrupt. Constant time. */
void modbus_server_receive(uint8_t byte);

/** A byte arrived broken (parity, framing, noise) or was lost: the frame it belongs to will be dropped. Same context.
 */
void modbus_server_line_error(void);

#endif
