/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/column_words.h"
#include <ctype.h>
#include <string.h>

enum {
    LONGEST = 72, /* bytes of a word */
    MOST_WORDS = 16,
    HEAD = 5,    /* letters of a known word that may stand before or behind an unknown one */
    STRANGE = 3, /* bytes of an unknown word that says something: "foo", a letter of Chinese */
    LETTER = 4   /* bytes of one */
};

typedef struct {
    unsigned stands_for;
    const char *words; /* separated by blanks */
} word_list_t;

static const word_list_t word_lists[] = {
#define WORDS(stands_for, words) {stands_for, words},
#include "recording/table/column_words.def"
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
            const unsigned rest = next == length                           ? WORD_NOTHING
                                  : behind[next] != 0                      ? behind[next]
                                  : word[next] == 's' && next + 2 < length ? behind[next + 1]
                                                                           : 0;
            behind[from] = one != 0 && rest != 0 ? one | rest : 0;
        }
    }
    return behind[0];
}

/* Whether a known word is long enough to stand beside an unknown one: two letters of Chinese are, five of others. */
static bool is_long(const char *part, size_t size) {
    const unsigned char first = (unsigned char)*part;
    return size >= (first >= 0xE0 ? 6 : first >= 0x80 ? 2 * HEAD : HEAD);
}

/* A known word at the end of an unknown one, and one at its beginning: "Messverstaerkerspannung". */
static unsigned known_part(const char *word, size_t length) {
    unsigned found = 0, before = 0;
    for (size_t size = length - 1; size >= HEAD && found == 0; size--) {
        found = is_long(word + length - size, size) ? look_up(word + length - size, size) : 0;
    }
    for (size_t size = length - 1; size >= HEAD && before == 0; size--) {
        before = is_long(word, size) ? look_up(word, size) : 0;
    }
    return found | before;
}

/* The first letter of UTF-8, and its bytes; 0: no UTF-8, one byte. */
static size_t code_at(const char *text, const char *end, unsigned *code) {
    const unsigned char first = (unsigned char)*text;
    const size_t more = first < 0xC0 ? 0 : first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
    *code = first < 0x80 ? first : more > 0 ? first & (0x3FU >> more) : 0;
    for (size_t i = 1; i <= more; i++) {
        if (text + i >= end || ((unsigned char)text[i] & 0xC0) != 0x80) {
            *code = 0;
            return 1;
        }
        *code = *code << 6 | ((unsigned char)text[i] & 0x3F);
    }
    return more + 1;
}

/* Signs, and letters that stand for quantities (Greek, units in one letter). */
static bool is_sign(unsigned code) {
    static const unsigned signs[][2] = {
        {0x80, 0xBF}, {0x370, 0x3FF}, {0x2000, 0x2BFF}, {0x3000, 0x303F}, {0x3200, 0x33FF}};
    for (size_t i = 0; i < sizeof signs / sizeof signs[0]; i++) {
        if (code >= signs[i][0] && code <= signs[i][1]) {
            return true;
        }
    }
    return false;
}

/* A letter without its accent, in small; 0: it is none. */
static unsigned plain_letter(unsigned code) {
    /* U+00C0 to U+017F; '.': none, or more than one letter */
    static const char latin[] = "aaaaaaaceeeeiiiidnooooo.ouuuuy.saaaaaaaceeeeiiiidnooooo.ouuuuy.y"
                                "aaaaaaccccccccddddeeeeeeeeeegggggggghhhhiiiiiiiiii..jjkkkllllll"
                                "..llnnnnnnnnnoooooo..rrrrrrssssssssttttttuuuuuuuuuuuuwwyyyzzzzzzs";
    if (code >= 0xFF01 && code <= 0xFF5E) { /* as wide as Chinese ones */
        code -= 0xFEE0;
    }
    if (code < 0x80) {
        return isalpha((int)code) ? (unsigned)tolower((int)code) : 0;
    }
    if (code >= 0xC0 && code < 0x180) {
        return latin[code - 0xC0] != '.' ? (unsigned)latin[code - 0xC0] : 0;
    }
    if (code == 0x401 || code == 0x451) { /* Russian yo */
        return 0x435;
    }
    if (code >= 0x400 && code < 0x430) { /* Cyrillic capitals */
        return code + (code < 0x410 ? 0x50 : 0x20);
    }
    return is_sign(code) ? 0 : code;
}

/* Appends a letter in UTF-8, if there is room. */
static void put_letter(unsigned code, char *text, size_t *length) {
    const size_t size = code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
    static const unsigned char first[] = {0, 0, 0xC0, 0xE0, 0xF0};
    for (size_t i = size; *length + size <= LONGEST && i-- > 0;) {
        text[*length + i] = (char)(i > 0 ? 0x80 | (code & 0x3F) : first[size] | code);
        code >>= 6;
    }
    *length += *length + size <= LONGEST ? size : 0;
}

typedef struct {
    char letter[LONGEST + LETTER];
    size_t length, foreign;
} word_t;

static size_t split_words(const char *text, const char *end, word_t word[MOST_WORDS]) {
    size_t count = 0;
    bool lower = false;
    word[0] = (word_t){0};
    for (const char *at = text; at < end;) {
        unsigned code;
        const size_t bytes = code_at(at, end, &code);
        const unsigned letter = plain_letter(code);
        const bool capital = code < 0x80 && isupper((int)code) != 0;
        if ((letter == 0 || (lower && capital)) && word[count].length > 0) {
            if (++count == MOST_WORDS) {
                return count;
            }
            word[count] = (word_t){0};
        }
        if (letter != 0) {
            put_letter(letter, word[count].letter, &word[count].length);
            word[count].foreign += code >= 0x80 ? 1 : 0;
        }
        lower = letter != 0 && !capital;
        at += bytes;
    }
    return count + (word[count].length > 0 ? 1 : 0);
}

/* What two words in a row stand for that are one thing, "analog input"; 0: they are two. */
static unsigned read_both(const word_t *word) {
    char joined[2 * LONGEST + 1];
    memcpy(joined, word[0].letter, word[0].length);
    memcpy(joined + word[0].length, word[1].letter, word[1].length);
    return look_up(joined, word[0].length + word[1].length);
}

static unsigned read_one(const word_t *word) {
    unsigned one = look_up(word->letter, word->length);
    one = one == 0 && word->length > 1 ? put_together(word->letter, word->length) : one;
    return one == 0 && word->length > HEAD ? known_part(word->letter, word->length) : one;
}

column_words_t column_words_read(const char *text, const char *end) {
    word_t word[MOST_WORDS];
    column_words_t reading = {.words = split_words(text, end, word)};
    for (size_t i = 0; i < reading.words; i++) {
        const unsigned both = i + 1 < reading.words ? read_both(&word[i]) : 0;
        const unsigned one = both == 0 ? read_one(&word[i]) : 0;
        reading.letters += word[i].length;
        reading.foreign += (both | one) != 0 ? word[i].foreign : 0;
        reading.stands_for |= both | one | (i == 0 && one == WORD_TIME ? WORD_FIRST : 0U);
        reading.strange = reading.strange || ((both | one) == 0 && word[i].length >= STRANGE);
        if (both != 0) {
            i++;
            reading.letters += word[i].length;
            reading.foreign += word[i].foreign;
        }
    }
    return reading;
}
