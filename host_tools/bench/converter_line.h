/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The converter line of the bench, seen from the actuator's side: position codes go out, drive codes come back.
 *
 * docs/DESIGN.md, section 6: a 16-bit code is three bytes, and only the first has bit 7 set. Each position code is
 * answered by one drive code before the next is sent. Position codes carry the supply of the stage with them, a part in
 * each (converter_beside_t).
 */
#ifndef CONVERTER_LINE_H
#define CONVERTER_LINE_H

#include "base/failure.h"
#include <signal.h>
#include <stdint.h>

#define CONVERTER_FRAME_BYTES 3

void converter_encode(uint16_t code, uint8_t frame[CONVERTER_FRAME_BYTES]);

/** A slow number beside the codes, in the spare bits 6 to 2 of their first bytes: in CONVERTER_BESIDE_CODES codes in a
 * row four bits each, the highest first, and bit 6 marks the first of them. Zero-initialised: begins. */
typedef struct {
    uint32_t word; /**< what of it is still to come, at bit 19 */
    unsigned left; /**< codes */
} converter_beside_t;

#define CONVERTER_BESIDE_CODES 5U
#define CONVERTER_BESIDE_MOST  0xFFFFFU /**< the largest number */

/** Puts the next part of the number into a frame. It is looked at where one begins, so it is sent whole. 0: there is
 * none, and nothing is sent. */
void converter_put_beside(converter_beside_t *beside, uint32_t number, uint8_t frame[CONVERTER_FRAME_BYTES]);

/** Bytes of the incoming frame. Zero-initialised: waits for a first byte. */
typedef struct {
    unsigned bytes;
    uint32_t bits;
} converter_decoder_t;

/** Takes one byte. Returns true when it completes a frame; then *code is valid. Other bytes are skipped. */
bool converter_decode(converter_decoder_t *decoder, uint8_t byte, uint16_t *code);

/** The open line. */
typedef struct {
    int file;
    const char *name;                  /**< for messages */
    const volatile sig_atomic_t *stop; /**< ends every wait when it becomes nonzero */
    unsigned long repetitions;         /**< frames that were sent again because no answer came */
    bool answered;                     /**< once */
    converter_decoder_t decoder;
    uint32_t supply_mv; /**< of the stage, at most CONVERTER_BESIDE_MOST, sent beside the positions; 0: not measured */
    converter_beside_t beside;
} converter_line_t;

typedef enum {
    CONVERTER_DONE,
    CONVERTER_ENDED /**< closed by the other end, or stop requested */,
    CONVERTER_FAILED
} converter_status_t;

/**
 * Opens `path`: a serial device or pseudo-terminal that exists, or a Unix socket that is created, listened on until one
 * partner connects, and then removed.
 */
converter_status_t converter_open(converter_line_t *line, const char *path, const volatile sig_atomic_t *stop,
                                  failure_t *failure);

/**
 * Sends a position code and waits for the drive code. A partner that has never answered may still be starting: the
 * frame is repeated without limit. Later the limit is ten seconds.
 */
converter_status_t converter_exchange(converter_line_t *line, uint16_t position, uint16_t *drive, failure_t *failure);

void converter_close(converter_line_t *line);

#endif
