/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The words of a name, and what they stand for (column_words.def). A name is taken apart at blanks, signs, digits,
 * capitals, and where known words are put together ("Vin", "Sollposition", "piezo_voltage", "印加電圧").
 */
#ifndef COLUMN_WORDS_H
#define COLUMN_WORDS_H

#include <stdbool.h>
#include <stddef.h>

enum {
    WORD_TIME = 1 << 0,
    WORD_COUNT = 1 << 1,
    WORD_VOLTS = 1 << 2,
    WORD_LENGTH = 1 << 3,
    WORD_AMPERES = 1 << 4,
    WORD_DEGREES = 1 << 5,
    WORD_OTHER = 1 << 6,
    WORD_COMMAND = 1 << 7,     /**< what goes into the actuator */
    WORD_TARGET = 1 << 8,      /**< what was wanted */
    WORD_MEASURED = 1 << 9,    /**< of whatever the other words name; alone it names nothing */
    WORD_RESULT = 1 << 10,     /**< the same; alone it is what comes out, the position */
    WORD_SENSOR = 1 << 11,     /**< of the position, unless other words name a quantity */
    WORD_DIFFERENCE = 1 << 12, /**< a control error */
    WORD_AXIS = 1 << 13,       /**< a length where nothing else is named */
    WORD_FIRST = 1 << 14,      /**< the name begins with a time: "Time - Voltage_0" are times */
    WORD_NOTHING = 1 << 15,
    WORD_QUANTITIES = WORD_TIME | WORD_COUNT | WORD_VOLTS | WORD_LENGTH | WORD_AMPERES | WORD_DEGREES
};

typedef struct {
    unsigned stands_for;   /**< of all words; 0: none is known */
    size_t words, letters; /**< letters: bytes of all words */
    size_t foreign;        /**< letters beyond ASCII of the known words */
    bool strange;          /**< a word of three letters or more is not known, or one in other letters than Latin */
} column_words_t;

/** The words of [text, end), UTF-8. Accents and capitals do not matter. */
column_words_t column_words_read(const char *text, const char *end);

#endif
