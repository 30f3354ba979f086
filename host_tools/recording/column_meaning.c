/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/column_meaning.h"
#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum {
    TIME = 1 << 0,
    COUNT = 1 << 1,
    VOLTS = 1 << 2,
    LENGTH = 1 << 3,
    AMPERES = 1 << 4,
    DEGREES = 1 << 5,
    OTHER = 1 << 6,
    COMMAND = 1 << 7,     /* what goes into the actuator */
    TARGET = 1 << 8,      /* what was wanted */
    MEASURED = 1 << 9,    /* of whatever the other words name; alone it names nothing */
    RESULT = 1 << 10,     /* the same; alone it is what comes out, the position */
    SENSOR = 1 << 11,     /* of the position, unless other words name a quantity */
    DIFFERENCE = 1 << 12, /* a control error */
    AXIS = 1 << 13,       /* a length where nothing else is named */
    FIRST = 1 << 14,      /* the name begins with a time: "Time - Voltage_0" are times */
    NOTHING = 1 << 15,
    QUANTITIES = TIME | COUNT | VOLTS | LENGTH | AMPERES | DEGREES,
    LONGEST = 40, /* letters of a word */
    MOST_WORDS = 16,
    HEAD = 5 /* letters of a known word that may stand before or behind an unknown one */
};

typedef struct {
    unsigned stands_for;
    const char *words; /* separated by blanks */
} word_list_t;

static const word_list_t word_lists[] = {
#define WORDS(stands_for, words) {stands_for, words},
#include "recording/column_words.def"
#undef WORDS
};

/* What a word stands for; 0: unknown. */
static unsigned look_up(const char *word, size_t length) {
    for (size_t i = 0; i < sizeof word_lists / sizeof word_lists[0]; i++) {
        const char *at = word_lists[i].words;
        while (*at != '\0') {
            const size_t size = strcspn(at, " ");
            if (size == length && memcmp(at, word, length) == 0) {
                return word_lists[i].stands_for;
            }
            at += size;
            at += strspn(at, " ");
        }
    }
    return 0;
}

/* A word made of known ones of two letters or more, with a German s between them: 0, or what they stand for together.
 * One letter may stand at the beginning: "vin", "xsoll". The longest first word counts. */
static unsigned put_together(const char *word, size_t length) {
    unsigned behind[LONGEST + 2] = {0}; /* what the letters from there on are put together of */
    for (size_t from = length; from-- > 0;) {
        const size_t least = from == 0 ? 1 : 2;
        for (size_t size = length - from; size >= least && behind[from] == 0; size--) {
            const size_t next = from + size;
            const unsigned one = look_up(word + from, size);
            const unsigned rest = next == length                           ? NOTHING
                                  : behind[next] != 0                      ? behind[next]
                                  : word[next] == 's' && next + 2 < length ? behind[next + 1]
                                                                           : 0;
            behind[from] = one != 0 && rest != 0 ? one | rest : 0;
        }
    }
    return behind[0];
}

/* A known word at the end of an unknown one, and one at its beginning: "Messverstaerkerspannung". */
static unsigned known_part(const char *word, size_t length) {
    unsigned found = 0;
    for (size_t size = length - 1; size >= HEAD && found == 0; size--) {
        found = look_up(word + length - size, size);
    }
    unsigned before = 0;
    for (size_t size = length - 1; size >= HEAD && before == 0; size--) {
        before = look_up(word, size);
    }
    return found | before;
}

/* Letters of UTF-8 without their accents, in small. Returns the bytes that were read; 0 in *letter: no letter. */
static size_t plain_letter(const char *text, char *letter) {
    /* U+00C0 to U+00FF; '.': none, or more than one letter */
    static const char latin[] = "aaaaaaaceeeeiiiidnooooo.ouuuuy.saaaaaaaceeeeiiiidnooooo.ouuuuy.y";
    const unsigned char c = (unsigned char)text[0];
    if (c == 0xC3 && ((unsigned char)text[1] & 0xC0) == 0x80) {
        const char plain = latin[(unsigned char)text[1] & 0x3F];
        *letter = (char)(plain != '.' ? plain : '\0');
        return 2;
    }
    *letter = (char)(c < 0x80 && isalpha(c) ? tolower(c) : '\0');
    return 1;
}

typedef struct {
    char letter[LONGEST + 1];
    size_t length;
} word_t;

typedef struct {
    unsigned stands_for;
    size_t words, letters; /* letters: of all words */
} reading_t;

static size_t split_words(const char *text, const char *end, word_t word[MOST_WORDS]) {
    size_t count = 0;
    bool lower = false;
    word[0].length = 0;
    for (const char *at = text; at < end;) {
        char letter;
        const size_t bytes = plain_letter(at, &letter);
        const bool capital = lower && isupper((unsigned char)*at) != 0;
        if ((letter == '\0' || capital) && word[count].length > 0) {
            if (++count == MOST_WORDS) {
                return count;
            }
            word[count].length = 0;
        }
        if (letter != '\0' && word[count].length < LONGEST) {
            word[count].letter[word[count].length++] = letter;
        }
        lower = letter != '\0' && isupper((unsigned char)*at) == 0;
        at += bytes;
    }
    return count + (word[count].length > 0 ? 1 : 0);
}

/* The words of a part of a name. Two in a row that are one thing count as that: "analog input". */
static reading_t read_words(const char *text, const char *end) {
    word_t word[MOST_WORDS];
    reading_t reading = {.words = split_words(text, end, word)};
    for (size_t i = 0; i < reading.words; i++) {
        char joined[2 * LONGEST + 1];
        const size_t length = word[i].length;
        reading.letters += length;
        if (i + 1 < reading.words) {
            memcpy(joined, word[i].letter, length);
            memcpy(joined + length, word[i + 1].letter, word[i + 1].length);
            const unsigned both = look_up(joined, length + word[i + 1].length);
            if (both != 0) {
                reading.stands_for |= both;
                reading.letters += word[++i].length;
                continue;
            }
        }
        unsigned one = look_up(word[i].letter, length);
        one = one == 0 && length > 1 ? put_together(word[i].letter, length) : one;
        one = one == 0 && length > HEAD ? known_part(word[i].letter, length) : one;
        reading.stands_for |= one | (i == 0 && one == TIME ? FIRST : 0U);
    }
    return reading;
}

const char *column_last_part(const char *name) {
    const char *last = strrchr(name, '/') != NULL ? strrchr(name, '/') + 1 : name;
    return strrchr(last, '.') != NULL && strrchr(last, '.')[1] != '\0' ? strrchr(last, '.') + 1 : last;
}

static unsigned of_unit(quantity_t quantity) {
    switch (quantity) {
    case QUANTITY_TIME:
        return TIME;
    case QUANTITY_INDEX:
        return COUNT;
    case QUANTITY_VOLTAGE:
        return VOLTS;
    case QUANTITY_LENGTH:
        return LENGTH;
    case QUANTITY_CURRENT:
        return AMPERES;
    case QUANTITY_TEMPERATURE:
        return DEGREES;
    case QUANTITY_FREQUENCY:
        return OTHER;
    case QUANTITY_UNKNOWN:
    case QUANTITY_DIGITS:
    default:
        return 0;
    }
}

/* The one quantity that is meant where words name several. */
static unsigned decide(unsigned w, unsigned unit) {
    if ((w & (LENGTH | DEGREES)) != 0) { /* "current position" */
        w &= ~(unsigned)AMPERES;
    }
    if ((w & (QUANTITIES & ~(unsigned)COUNT)) != 0 || (w & SENSOR) != 0) { /* "sample time", "point voltage" */
        w &= ~(unsigned)COUNT;
    }
    if ((w & TIME) != 0 && (w & (VOLTS | LENGTH | AMPERES | DEGREES)) != 0) { /* "real-time position" */
        w &= (w & FIRST) != 0 && (unit == 0 || unit == TIME) ? ~(unsigned)(VOLTS | LENGTH | AMPERES | DEGREES)
                                                             : ~(unsigned)TIME;
    }
    if ((w & AXIS) != 0 && (w & QUANTITIES) == 0 && (unit == 0 || unit == LENGTH)) { /* not "Z Piezo" in volts */
        w |= LENGTH;
    }
    return w;
}

/* In volts that are a position: they need a scale. */
static meaning_t volts_of_position(unsigned w, bool by_words) {
    if ((w & (COMMAND | TARGET)) == 0) {
        return MEANING_DISPLACEMENT;
    }
    return by_words ? MEANING_OTHER : (w & TARGET) != 0 || (w & LENGTH) != 0 ? MEANING_REFERENCE : MEANING_DISPLACEMENT;
}

static meaning_t of_voltage(unsigned w) {
    if ((w & MEASURED) != 0 || ((w & RESULT) != 0 && (w & (COMMAND | TARGET)) == 0)) {
        return MEANING_MEASURED_VOLTAGE;
    }
    return (w & (COMMAND | TARGET)) != 0 ? MEANING_DRIVE : MEANING_VOLTAGE;
}

static meaning_t of_length(unsigned w) {
    const bool wanted = (w & TARGET) != 0 || ((w & COMMAND) != 0 && (w & (SENSOR | MEASURED | RESULT)) == 0);
    return wanted ? MEANING_REFERENCE : MEANING_DISPLACEMENT;
}

/* From all words, and from the unit, which is 0 where none or an unknown one is stated. */
static meaning_t combine(unsigned w, unsigned unit) {
    w = decide(w, unit);
    const unsigned named = w & QUANTITIES;
    if ((w & DIFFERENCE) != 0) {
        return MEANING_ERROR;
    }
    if ((w & OTHER) != 0 || unit == OTHER || (named & (named - 1U) & ~(unsigned)(LENGTH | VOLTS)) != 0) {
        return MEANING_OTHER;
    }
    if (named == 0 && (unit & (unsigned)(TIME | COUNT | DEGREES)) != 0) {
        w &= ~(unsigned)SENSOR; /* of what the unit says */
    }
    if (((w & LENGTH) != 0 || (w & SENSOR) != 0) && (w & (AMPERES | DEGREES | TIME)) == 0) {
        return (w & VOLTS) != 0                                 ? volts_of_position(w, true)
               : unit == VOLTS                                  ? volts_of_position(w, false)
               : unit == 0 || unit == LENGTH || unit == AMPERES ? of_length(w)
                                                                : MEANING_OTHER;
    }
    if (named != 0 && unit != 0 && unit != named) {
        return MEANING_OTHER; /* the unit contradicts the name */
    }
    switch (named != 0 ? named : unit) {
    case TIME:
        return MEANING_TIME;
    case COUNT:
        return MEANING_COUNTER;
    case VOLTS:
        return of_voltage(w);
    case LENGTH:
        return of_length(w);
    case AMPERES:
        return MEANING_CURRENT;
    case DEGREES:
        return MEANING_TEMPERATURE;
    default:
        break;
    }
    if ((w & TARGET) != 0) {
        return MEANING_REFERENCE;
    }
    if ((w & COMMAND) != 0) {
        return (w & MEASURED) != 0 ? MEANING_MEASURED_VOLTAGE : MEANING_DRIVE;
    }
    return (w & RESULT) != 0 ? MEANING_DISPLACEMENT : MEANING_UNKNOWN;
}

static column_meaning_t judge(const reading_t *reading, quantity_t unit) {
    const unsigned w = reading->stands_for & ~(unsigned)NOTHING;
    const bool letter = reading->words == 1 && reading->letters == 1;
    column_meaning_t result = {.meaning = combine(w, of_unit(unit)),
                               .said = w == 0 || (w == AXIS && of_unit(unit) != 0 && of_unit(unit) != LENGTH)
                                           ? SAID_BY_UNIT
                                       : letter || w == RESULT || w == COUNT ? SAID_WEAKLY
                                                                             : SAID_BY_NAME,
                               .quantity = unit};
    if (result.meaning == MEANING_OTHER && letter && w != OTHER) { /* "X" in seconds */
        result.meaning = combine(0, of_unit(unit));
        result.said = SAID_BY_UNIT;
    }
    if (result.meaning == MEANING_DRIVE && (w & (COMMAND | VOLTS)) == 0) { /* "Ref1" in volts */
        result.said = SAID_WEAKLY;
    }
    if (unit == QUANTITY_UNKNOWN && (decide(w, of_unit(unit)) & VOLTS) != 0) {
        result.quantity = QUANTITY_VOLTAGE;
    }
    return result;
}

column_meaning_t column_meaning(const table_column_t *column) {
    double scale;
    const char *last = column_last_part(column->name), *end = last + strlen(last);
    const quantity_t unit = unit_of(column->unit, &scale);
    reading_t reading = read_words(last, end);
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
        const reading_t parent = read_words(before, last - 1);
        reading.stands_for |= parent.stands_for;
        reading.words += parent.words;
        reading.letters += parent.letters;
        const column_meaning_t whole = judge(&reading, unit);
        if (whole.meaning != MEANING_UNKNOWN && (parent.stands_for & ~(unsigned)NOTHING) != 0) {
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
