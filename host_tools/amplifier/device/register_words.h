/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Registers as they are on the line: words of 16 bits, of which a value has one or two, high word first. */
#ifndef REGISTER_WORDS_H
#define REGISTER_WORDS_H

#include "amplifier/line/serial_line.h"
#include "registers/register_table.h"

/** So often a request is made that gets no answer, or a damaged one. */
#define REGISTER_TRIES 3

/** A request that reads the registers first..last, which have neighbouring addresses, into `words`. It has the name of
 * the first. */
request_t register_words_request(int first, int last, uint16_t *words);

/** Their values: value[first] to value[last]. */
void register_words_decode(int first, int last, const uint16_t *words, int64_t *value);

/** Asks for them, and nothing else where that is refused, as device_read_span does. */
bool register_words_read(serial_line_t *line, int first, int last, int64_t *value, failure_t *failure);

/** What fits into the register. */
void register_words_range(int which, int64_t *low, int64_t *high);

/** Appends a value to the `count` words of a request; refuses one that does not fit. */
bool register_words_append(int which, int64_t value, uint16_t *words, int *count, failure_t *failure);

enum { REGISTER_SPAN_NAME = 100 };
/** For messages: "register mode", "registers source_offset to source_cycles". */
void register_words_name(int first, int last, char what[REGISTER_SPAN_NAME]);

#endif
