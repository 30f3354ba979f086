/* SPDX-License-Identifier: MIT */
/**
 * The Modbus line: USART1, 8 data bits, 1 stop bit, with an RS-485 driver enable pin; rate and parity by
 * board_modbus_line (firmware/app/store/line_settings.h). The frame logic is firmware/app's; pins: docs/WIRING.md.
 *
 * Receiving is by interrupt, into modbus_server_receive. The interrupt is lower than the sample interrupt: a byte takes
 * 87 us at 115200 baud and the receiver holds one while the next arrives, so the sample interrupt may take that long
 * without loss.
 *
 * Sending (board_modbus_send) blocks the main loop until the frame is out, at most 25 ms at 115200 baud and 0.3 s at
 * 9600. The line is half duplex, so there is nothing else to do, and QEMU 7.2 has no transmit interrupts. The driver
 * enable is set before the first start bit and cleared within microseconds (plus a sample interrupt) after the last
 * stop bit has left the shift register.
 *
 * On a half-duplex line the receiver's interrupt is off from before the driver enable until after it, so that a
 * transceiver whose /RE is wired to ground, or an adapter that echoes, does not make the amplifier hear itself. What
 * came meanwhile is thrown away if it was more than one byte, which overruns the receiver: every answer is longer. (A
 * single byte is the beginning of a request: the emulated line has two directions.)
 */
#ifndef MODBUS_LINE_H
#define MODBUS_LINE_H

#include <stdbool.h>
#include <stdint.h>

/** NVIC priority of the line, and the higher one of the sample interrupt. */
enum { PRIORITY_SAMPLE = 0, PRIORITY_MODBUS = 4 };

/** Pins and USART1, with the default settings. apb2_hz: the clock of the bus USART1 sits on. half_duplex: deaf while
 * sending. Received bytes go to firmware/app from here on. */
void modbus_line_init(uint32_t apb2_hz, bool half_duplex);

#endif
