/* SPDX-License-Identifier: MIT */
/**
 * The settings of the Modbus line: address, rate, parity. Always 8 data bits and 1 stop bit. They are stored beside the
 * parameter image (image_store.h) and changed by command 13, while the amplifier is off.
 */
#ifndef LINE_SETTINGS_H
#define LINE_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

/** Register `line_parity`, and in the store: append only. */
typedef enum { LINE_PARITY_NONE = 0, LINE_PARITY_EVEN = 1, LINE_PARITY_ODD = 2 } line_parity_t;

typedef struct {
    uint32_t address; /**< 1 to LINE_ADDRESS_MAX */
    uint32_t baud;    /**< LINE_BAUD_MIN to LINE_BAUD_MAX, as far as the board's divider makes it */
    uint32_t parity;  /**< line_parity_t */
} line_settings_t;

/** Where nothing is stored, and where the board wants it so (board_start_t.default_line). The Modbus
 * standard's default is even parity; without one it asks for two stop bits. Nearly every adapter and master is set to
 * 8N1, and the frame's CRC does not miss what parity finds. */
#define LINE_SETTINGS_DEFAULT                                                                                          \
    { .address = 1U, .baud = 115200U, .parity = LINE_PARITY_NONE }

#define LINE_ADDRESS_MAX 247U
/** An answer of 256 bytes takes 0.3 s at the lower one, in which the main loop waits for it. At the upper one a byte
 * takes 20 us, which leaves a sample 1199 instructions (line_sample_budget): play banks and Bouc-Wen cells fit, with
 * some filters. The next rates that adapters have, 921600 and 1 Mbaud, leave no image at all. */
#define LINE_BAUD_MIN 9600U
#define LINE_BAUD_MAX 500000U

/** What a clock has to be divided by for this rate, rounded: within 1.5 %, and 16 to 65535 as a UART of the STM32 has
 * it; else 0. (Both ends together may be off by some 4 % of a bit time over a frame of 10 or 11 bits.) */
uint32_t line_divider(uint32_t clock_hz, uint32_t baud);

/** Cycles that a sample may take so that no byte is lost at this rate. Bytes come by an interrupt below the sample's,
 * and a UART holds one byte while the next arrives. The ends of two bytes are 10 bits apart: in that time a whole
 * sample has to fit, with all that hyst_cost_budget keeps apart and LINE_CYCLES_BESIDE. Calculated, not seen on
 * silicon. core_hz: 1 MHz or more. */
uint32_t line_sample_budget(uint32_t core_hz, uint32_t baud);

/** To take the byte, and the longest time for which the main loop locks interrupts out: 100 instructions each, more
 * than were counted, of 2 cycles each, as assumed in hyst/cost.h. */
#define LINE_CYCLES_BESIDE 400U

/** Address, rate (board_modbus_baud_possible) and parity are possible. */
bool line_settings_valid(const line_settings_t *line);

/** Microseconds of silence that end a frame at this rate: 3.5 characters of 11 bits, and never less than what the board
 * says (board_info.modbus_silence_us). */
uint32_t line_silence_us(uint32_t baud);

/** Microseconds from the end of a byte to the end of the next one, as board_microseconds has them: after more the
 * second one begins a frame. A period of the loop, that clock's step, less than the silence. So after a silence of a
 * master's it always does, whose ends of bytes are a character farther apart than the silence; and after 1.5 characters
 * never. */
uint32_t line_gap_us(uint32_t baud);

#endif
