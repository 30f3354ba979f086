/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/column_meaning.h"
#include "recording/table/column_words.h"
#include <string.h>

const char *column_last_part(const char *name) {
    const char *last = strrchr(name, '/') != NULL ? strrchr(name, '/') + 1 : name;
    return strrchr(last, '.') != NULL && strrchr(last, '.')[1] != '\0' ? strrchr(last, '.') + 1 : last;
}

static unsigned of_unit(quantity_t quantity) {
    switch (quantity) {
    case QUANTITY_TIME:
        return WORD_TIME;
    case QUANTITY_INDEX:
        return WORD_COUNT;
    case QUANTITY_VOLTAGE:
        return WORD_VOLTS;
    case QUANTITY_LENGTH:
        return WORD_LENGTH;
    case QUANTITY_CURRENT:
        return WORD_AMPERES;
    case QUANTITY_TEMPERATURE:
        return WORD_DEGREES;
    case QUANTITY_FREQUENCY:
        return WORD_OTHER;
    case QUANTITY_UNKNOWN:
    case QUANTITY_DIGITS:
    default:
        return 0;
    }
}

/* The one quantity that is meant where words name several. */
static unsigned decide(unsigned w, unsigned unit) {
    if ((w & (WORD_LENGTH | WORD_DEGREES)) != 0) { /* "current position" */
        w &= ~(unsigned)WORD_AMPERES;
    }
    if ((w & (WORD_QUANTITIES & ~(unsigned)WORD_COUNT)) != 0 ||
        (w & WORD_SENSOR) != 0) { /* "sample time", "point voltage" */
        w &= ~(unsigned)WORD_COUNT;
    }
    if ((w & WORD_TIME) != 0 &&
        (w & (WORD_VOLTS | WORD_LENGTH | WORD_AMPERES | WORD_DEGREES)) != 0) { /* "real-time position" */
        w &= (w & WORD_FIRST) != 0 && (unit == 0 || unit == WORD_TIME)
                 ? ~(unsigned)(WORD_VOLTS | WORD_LENGTH | WORD_AMPERES | WORD_DEGREES)
                 : ~(unsigned)WORD_TIME;
    }
    if ((w & WORD_FIRST) != 0 && unit == WORD_TIME) { /* "Time 1 - default sample rate" in s */
        w &= ~(unsigned)WORD_OTHER;
    }
    if ((w & WORD_AXIS) != 0 && (w & WORD_QUANTITIES) == 0 &&
        (unit == 0 || unit == WORD_LENGTH)) { /* not "Z Piezo" in volts */
        w |= WORD_LENGTH;
    }
    return w;
}

/* In volts that are a position: they need a scale. */
static meaning_t volts_of_position(unsigned w, bool by_words) {
    if ((w & (WORD_COMMAND | WORD_TARGET)) == 0) {
        return MEANING_DISPLACEMENT;
    }
    return by_words                                           ? MEANING_OTHER
           : (w & WORD_TARGET) != 0 || (w & WORD_LENGTH) != 0 ? MEANING_REFERENCE
                                                              : MEANING_DISPLACEMENT;
}

static meaning_t of_voltage(unsigned w) {
    if ((w & WORD_MEASURED) != 0 || ((w & WORD_RESULT) != 0 && (w & (WORD_COMMAND | WORD_TARGET)) == 0)) {
        return MEANING_MEASURED_VOLTAGE;
    }
    return (w & (WORD_COMMAND | WORD_TARGET)) != 0 ? MEANING_DRIVE : MEANING_VOLTAGE;
}

static meaning_t of_length(unsigned w) {
    const bool wanted =
        (w & WORD_TARGET) != 0 || ((w & WORD_COMMAND) != 0 && (w & (WORD_SENSOR | WORD_MEASURED | WORD_RESULT)) == 0);
    return wanted ? MEANING_REFERENCE : MEANING_DISPLACEMENT;
}

/* From all words, and from the unit, which is 0 where none or an unknown one is stated. */
static meaning_t combine(unsigned w, unsigned unit) {
    w = decide(w, unit);
    const unsigned named = w & WORD_QUANTITIES;
    if ((w & WORD_DIFFERENCE) != 0) {
        return MEANING_ERROR;
    }
    if ((w & WORD_OTHER) != 0 || unit == WORD_OTHER ||
        (named & (named - 1U) & ~(unsigned)(WORD_LENGTH | WORD_VOLTS)) != 0) {
        return MEANING_OTHER;
    }
    if (named == 0 && (unit & (unsigned)(WORD_TIME | WORD_COUNT | WORD_DEGREES)) != 0) {
        w &= ~(unsigned)WORD_SENSOR; /* of what the unit says */
    }
    if (((w & WORD_LENGTH) != 0 || (w & WORD_SENSOR) != 0) && (w & (WORD_AMPERES | WORD_DEGREES | WORD_TIME)) == 0) {
        return (w & WORD_VOLTS) != 0                                      ? volts_of_position(w, true)
               : unit == WORD_VOLTS                                       ? volts_of_position(w, false)
               : unit == 0 || unit == WORD_LENGTH || unit == WORD_AMPERES ? of_length(w)
                                                                          : MEANING_OTHER;
    }
    if (named != 0 && unit != 0 && unit != named) {
        return MEANING_OTHER; /* the unit contradicts the name */
    }
    switch (named != 0 ? named : unit) {
    case WORD_TIME:
        return MEANING_TIME;
    case WORD_COUNT:
        return MEANING_COUNTER;
    case WORD_VOLTS:
        return of_voltage(w);
    case WORD_LENGTH:
        return of_length(w);
    case WORD_AMPERES:
        return MEANING_CURRENT;
    case WORD_DEGREES:
        return MEANING_TEMPERATURE;
    default:
        break;
    }
    if ((w & WORD_TARGET) != 0) {
        return MEANING_REFERENCE;
    }
    if ((w & WORD_COMMAND) != 0) {
        return (w & WORD_MEASURED) != 0 ? MEANING_MEASURED_VOLTAGE : MEANING_DRIVE;
    }
    return (w & WORD_RESULT) != 0 ? MEANING_DISPLACEMENT : MEANING_UNKNOWN;
}

static column_meaning_t judge(const column_words_t *reading, quantity_t unit) {
    const unsigned w = reading->stands_for & ~(unsigned)WORD_NOTHING;
    const bool letter = reading->words == 1 && reading->letters == 1;
    column_meaning_t result = {.meaning = combine(w, of_unit(unit)),
                               .said = w == 0 || (w == WORD_AXIS && of_unit(unit) != 0 && of_unit(unit) != WORD_LENGTH)
                                           ? SAID_BY_UNIT
                                       : letter || w == WORD_RESULT || w == WORD_COUNT ? SAID_WEAKLY
                                                                                       : SAID_BY_NAME,
                               .quantity = unit,
                               .strange = reading->strange};
    if (result.meaning == MEANING_OTHER && letter && w != WORD_OTHER) { /* "X" in seconds */
        result.meaning = combine(0, of_unit(unit));
        result.said = SAID_BY_UNIT;
    }
    if (result.meaning == MEANING_DRIVE && (w & (WORD_COMMAND | WORD_VOLTS)) == 0) { /* "Ref1" in volts */
        result.said = SAID_WEAKLY;
    }
    if (unit == QUANTITY_UNKNOWN && (decide(w, of_unit(unit)) & WORD_VOLTS) != 0) {
        result.quantity = QUANTITY_VOLTAGE;
    }
    return result;
}

column_meaning_t column_meaning(const table_column_t *column) {
    double scale;
    const char *last = column_last_part(column->name), *end = last + strlen(last);
    const quantity_t unit = unit_of(column->unit, &scale);
    column_words_t reading = column_words_read(last, end);
    column_meaning_t result = judge(&reading, unit);
    /* "u" alone is what control engineers call the input. */
    if (result.meaning == MEANING_VOLTAGE && (strcmp(last, "u") == 0 || strcmp(last, "U") == 0)) {
        result.meaning = MEANING_DRIVE;
    }
    if (result.meaning == MEANING_DISPLACEMENT && result.said == SAID_WEAKLY && strcmp(column->unit, "%") == 0) {
        result.meaning = MEANING_DRIVE; /* "Output" in percent of full scale is the amplifier's */
    }
    if (last > column->name && (result.meaning == MEANING_UNKNOWN || result.said != SAID_BY_NAME)) {
        const char *before = last - 1; /* the part before it: "Position Sensor/Out1" */
        while (before > column->name && before[-1] != '/' && before[-1] != '.') {
            before--;
        }
        const column_words_t parent = column_words_read(before, last - 1);
        reading.stands_for |= parent.stands_for;
        reading.words += parent.words;
        reading.letters += parent.letters;
        const column_meaning_t whole = judge(&reading, unit);
        if (whole.meaning != MEANING_UNKNOWN && (parent.stands_for & ~(unsigned)WORD_NOTHING) != 0) {
            result = whole;
        }
    }
    return result;
}

const char *meaning_text(meaning_t meaning) {
    static const char *const texts[] = {
        "unknown", "time",        "counter",      "drive",     "voltage",       "measured voltage",
        "current", "temperature", "displacement", "reference", "control error", "another quantity"};
    return texts[meaning];
}
