/* SPDX-License-Identifier: MIT */
/**
 * A Modbus RTU server. Functions for registers: 3 and 4 (read; one and the same map), 6 and 16 (write), 22 (mask), 23
 * (write, then read). Others: 1, 2, 5 and 15 (modbus_bits.h), 8 (query data, clear, errors, messages) and 43/14 (device
 * identification: vendor, product, revision; stream and individual access).
 *
 * Bytes come from an interrupt (board.h) through a ring; a silence ends a frame. In this order: the complete frame, its
 * length, its CRC, its address, and only then its meaning. A frame that fails one of the first three gets no answer and
 * is counted. One for another server gets none either, and neither does one with a function code of 0x80 or more: that
 * is a server's exception, not a request. A request to address 0 (broadcast) is never answered; it is executed if its
 * function only writes, and all that it writes is meant for every amplifier (control_may_be_broadcast).
 *
 * Silence. By the standard 3.5 characters (1.75 ms above 19200 baud) lie between two frames, and a frame with a pause
 * of more than 1.5 (0.75 ms) is to be dropped. Here 3.5 are always a silence, and 1.5 never are (line_gap_us). A pause
 * of up to some 2.5 (1.5 ms) is not held against a frame, because USB adapters hand it over in packets. A longer one
 * ends it, and each part of a cut frame fails its length or CRC. A frame that nothing follows is served once
 * line_silence_us have passed.
 *
 * A board whose line has no other server and loses no byte, as the emulated one, says so (modbus_ends_at_length). There
 * a request whose length is its own (modbus_request_length), and whose CRC is right, does not wait for a silence. Any
 * other frame does.
 *
 * Echo. Some lines return what is sent. A board of a half-duplex line does not listen while it sends (board.h). What
 * still comes back is known by its bytes. When a frame begins within two silences of an answer's end and begins with a
 * copy of that answer, the copy is dropped and counted (`line_echoes`), and what follows it is the frame. Only the
 * answers of functions 5, 6, 8 and 22 are equal to their requests: there a copy may be a master's same request again.
 * By the standard a master leaves a silence first, and an echo begins at once: so a copy that begins a silence after
 * the answer's end is served, unless the line has returned another answer as late. One that begins sooner may be a
 * hasty master's, and the line's past decides: when it has not returned the last four answers, it is served, unless it
 * came while the answer was being sent. An answer that comes back, or the end of one, shows that the line has an echo;
 * from a start on it is taken to have one. No such copy is a sign of life.
 *
 * References: Modbus application protocol V1.1b3; Modbus over serial line V1.02.
 */
#ifndef MODBUS_SERVER_H
#define MODBUS_SERVER_H

#include "store/line_settings.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MODBUS_FRAME_MAX         256U /**< address, 253 bytes, CRC */
#define MODBUS_READ_MAX          125U /**< registers a request */
#define MODBUS_WRITE_MAX         123U
#define MODBUS_READ_WRITE_MAX    121U /**< written registers of function 23 */
#define MODBUS_BROADCAST_ADDRESS 0U

typedef enum {
    MODBUS_FRAME_BROKEN,    /**< too short, too long, or a wrong CRC */
    MODBUS_FRAME_FOREIGN,   /**< for another server, or no request at all */
    MODBUS_FRAME_BROADCAST, /**< accepted, and not to be answered */
    MODBUS_FRAME_ANSWERED,  /**< accepted */
    MODBUS_FRAME_REFUSED    /**< answered with an exception; a broadcast is not answered even so */
} modbus_outcome_t;

/** Serves one complete frame. *reply_length is 0 unless answered. No input or output; what it depends on and changes is
 * the registers. Main loop only. */
modbus_outcome_t modbus_serve(const uint8_t *frame, size_t length, uint8_t reply[MODBUS_FRAME_MAX],
                              size_t *reply_length);

/** How long a request is by its own account, CRC included: of functions 1 to 6, 15, 16, 22 and 23. 0: another function,
 * or too few bytes to tell. It may be more than MODBUS_FRAME_MAX. */
size_t modbus_request_length(const uint8_t *frame, size_t length);

/** CRC-16 of the protocol (reflected, 0xA001, start 0xFFFF); low byte goes out first. Over a frame and its CRC it is 0.
 */
uint16_t modbus_crc(const uint8_t *bytes, size_t count);

/** No byte received, counters zero, and the line as it is in these settings, which are valid. */
void modbus_server_init(const line_settings_t *settings);

/** The line has these settings, which are valid, as soon as the request that is being served has its answer. Main
 * loop only. */
void modbus_server_change_line(const line_settings_t *settings);

/** Makes it so, once the answer is out: modbus_server_poll does. For who serves frames by itself. */
void modbus_server_take_line(void);

/** The server's address. Main loop only. */
uint32_t modbus_server_address(void);

/** Takes what arrived and serves the frames that are complete. Returns whether there was one. Main loop only. */
bool modbus_server_poll(void);

/** Requests that were accepted, wrapping. Neither a refused request nor other bytes on the line count as a master's
 * sign of life. Main loop only. */
uint32_t modbus_server_accepted(void);

/** Registers `line_errors`, `frames_served` and `line_echoes`. They saturate. Main loop only. */
typedef struct {
    uint16_t errors, served, echoes;
} modbus_counters_t;

modbus_counters_t modbus_server_counters(void);
void modbus_server_clear(void);

#endif
