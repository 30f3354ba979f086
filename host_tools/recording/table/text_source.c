/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_source.h"
#include "recording/table/column_words.h"
#include "recording/table/units.h"
#include <errno.h>
#include <iconv.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum {
    CHUNK = 1 << 20,
    TRIED = 4096, /* bytes of lines beyond ASCII that decide the encoding */
    WORD = 80,    /* bytes of a word of these */
    QUOTED = 200  /* bytes of a field in quotes that may go on in the next line */
};

/* The whole file, unpacked; zlib hands plain files through. The buffer is one longer than `length`. */
static char *read_all(const char *path, size_t *length, bool *compressed, failure_t *failure) {
    gzFile file = gzopen(path, "rb");
    char *text = NULL;
    size_t room = 0;
    int got;
    *length = 0;
    if (file == NULL) {
        fail(failure, "%s: %s", path, strerror(errno));
        return NULL;
    }
    gzbuffer(file, CHUNK);
    do {
        if (room - *length < CHUNK) {
            room = 2 * room + 2 * CHUNK;
            text = reallocate(text, room + 1, 1);
        }
        got = gzread(file, text + *length, CHUNK);
        if (got > 0) {
            *length += (size_t)got;
        }
    } while (got > 0);
    *compressed = gzdirect(file) == 0;
    if (got < 0) {
        int error;
        const char *line = gzerror(file, &error);
        fail(failure, "%s: %s", path, error == Z_ERRNO ? strerror(errno) : line);
        gzclose(file);
        free(text);
        return NULL;
    }
    if (gzclose(file) == Z_BUF_ERROR) {
        fail(failure, "%s: the compressed data ends in the middle", path);
        free(text);
        return NULL;
    }
    text[*length] = '\0';
    return text;
}

/* A text in another encoding as UTF-8, to be freed; NULL if it is not of that encoding. */
static char *converted(const char *text, size_t *length, const char *from) {
    const size_t room = 3 * *length + 4;
    char *result = allocate(room + 1, 1), *in = (char *)(uintptr_t)text, *out = result; /* iconv writes nothing there */
    size_t in_left = *length, out_left = room;
    iconv_t converter = iconv_open("UTF-8", from);
    const bool good =
        converter != (iconv_t)-1 && iconv(converter, &in, &in_left, &out, &out_left) != (size_t)-1 && in_left == 0;
    if (converter != (iconv_t)-1) {
        iconv_close(converter);
    }
    if (!good) {
        free(result);
        return NULL;
    }
    *length = room - out_left;
    result[*length] = '\0';
    return result;
}

static char *convert(char *text, size_t *length, const char *from) {
    char *const result = converted(text, length, from);
    free(text);
    return result;
}

/* Letters beyond ASCII that a text of UTF-8 has in words and units that are known. */
static size_t known_letters(const char *text) {
    size_t known = 0;
    while (*text != '\0') {
        char word[WORD];
        double scale;
        const size_t length = strcspn(text, " \t\r\n,;:|\"'()[]{}/_=");
        size_t beyond = 0;
        for (size_t i = 0; i < length; i++) {
            beyond += ((unsigned char)text[i] & 0xC0) == 0xC0;
        }
        if (beyond > 0 && length < sizeof word) {
            memcpy(word, text, length);
            word[length] = '\0';
            known +=
                unit_of(word, &scale) != QUANTITY_UNKNOWN ? beyond : column_words_read(word, word + length).foreign;
        }
        text += length > 0 ? length : 1;
    }
    return known;
}

/* The first lines with bytes beyond ASCII, to be freed. */
static char *lines_beyond_ascii(const char *text, size_t length, size_t *found) {
    char *lines = allocate(TRIED + 1, 1);
    *found = 0;
    for (size_t begin = 0, i = 0; i < length && *found < TRIED; i++) {
        if (text[i] == '\n' || text[i] == '\r') {
            begin = i + 1;
        } else if ((unsigned char)text[i] >= 0x80) {
            while (i < length && text[i] != '\n' && text[i] != '\r') {
                i++;
            }
            const size_t size = i - begin < TRIED - *found ? i - begin : TRIED - *found;
            memcpy(lines + *found, text + begin, size);
            *found += size;
            begin = i + 1;
            if (*found < TRIED) {
                lines[(*found)++] = '\n';
            }
        }
    }
    return lines;
}

typedef struct {
    const char *name, *shown;
} encoding_t;

/* Bytes that are no UTF-8 are in the encoding in which most words and units of the file are known; Latin-1 where none
 * is. */
static const encoding_t *most_known(const char *text, size_t length) {
    static const encoding_t encodings[] = {
        {"CP1252", "Latin-1"},      {"CP1251", "Windows-1251"}, {"CP932", "Shift-JIS"},     {"GB18030", "GB 18030"},
        {"EUC-KR", "EUC-KR"},       {"EUC-JP", "EUC-JP"},       {"BIG5", "Big5"},           {"KOI8-R", "KOI8-R"},
        {"CP866", "code page 866"}, {"CP850", "code page 850"}, {"CP1250", "Windows-1250"}, {"MACINTOSH", "Macintosh"}};
    const encoding_t *best = &encodings[0];
    size_t size, most = 0;
    char *lines = lines_beyond_ascii(text, length, &size);
    for (size_t i = 0; i < sizeof encodings / sizeof encodings[0]; i++) {
        size_t converted_size = size;
        char *utf8 = converted(lines, &converted_size, encodings[i].name);
        const size_t known = utf8 != NULL ? known_letters(utf8) : 0;
        if (known > most) {
            most = known;
            best = &encodings[i];
        }
        free(utf8);
    }
    free(lines);
    return best;
}

static bool is_utf8(const char *text, size_t length) {
    for (size_t i = 0; i < length;) {
        const unsigned char c = (unsigned char)text[i];
        const size_t more = c < 0x80 ? 0 : (c & 0xE0) == 0xC0 ? 1 : (c & 0xF0) == 0xE0 ? 2 : (c & 0xF8) == 0xF0 ? 3 : 4;
        if (more == 4 || i + more >= length + (more == 0)) {
            return false;
        }
        for (size_t j = 1; j <= more; j++) {
            if (((unsigned char)text[i + j] & 0xC0) != 0x80) {
                return false;
            }
        }
        i += more + 1;
    }
    return true;
}

/* Without a mark: in UTF-16 nearly every second byte of a table is 0. */
static const char *utf16_without_mark(const char *text, size_t length) {
    const size_t look = length < 400 ? length : 400;
    size_t zeros[2] = {0, 0};
    for (size_t i = 0; i < look; i++) {
        zeros[i % 2] += text[i] == '\0';
    }
    if (look >= 4 && zeros[0] * 2 * 10 >= look * 9 && zeros[1] == 0) {
        return "UTF-16BE";
    }
    return look >= 4 && zeros[1] * 2 * 10 >= look * 9 && zeros[0] == 0 ? "UTF-16LE" : NULL;
}

/* What stands for a sign where a program took it for another one; NULL: nothing. `bytes`: of what is replaced. */
static const char *meant(const char *text, size_t *bytes) {
    static const struct {
        const char *written, *meant;
    } signs[] = {{"\xC3\x82\xC2\xB5", "\xC2\xB5"}, /* UTF-8 that was read as Latin-1: a micro sign */
                 {"\xC3\x8E\xC2\xBC", "\xC2\xB5"}, /* a Greek mu */
                 {"\xC3\x82\xC2\xB0", "\xC2\xB0"}, /* a degree */
                 {"\xE2\x88\x92", "-"}};           /* the printed minus */
    for (size_t i = 0; i < sizeof signs / sizeof signs[0]; i++) {
        *bytes = strlen(signs[i].written);
        if (strncmp(text, signs[i].written, *bytes) == 0) {
            return signs[i].meant;
        }
    }
    return NULL;
}

/* None becomes longer. */
static void repair_signs(char *text, size_t *length) {
    char *to = text;
    const char *from = text, *const end = text + *length;
    while (from < end) {
        const size_t plain = strcspn(from, "\xC3\xE2"); /* up to 0, too */
        memmove(to, from, plain);
        to += plain;
        from += plain;
        size_t bytes = 1;
        const char *const sign = from < end ? meant(from, &bytes) : NULL;
        if (sign != NULL) {
            memmove(to, sign, strlen(sign));
            to += strlen(sign);
            from += bytes;
        } else if (from < end) {
            *to++ = *from++;
        }
    }
    *to = '\0';
    *length = (size_t)(to - text);
}

/* Zeros behind the end, where a logger reserved room, and the sign for the end of a file of DOS. */
static void cut_padding(char *text, size_t *length) {
    while (*length > 0 && (text[*length - 1] == '\0' || text[*length - 1] == 0x1A)) {
        text[--*length] = '\0';
    }
}

static char *to_utf8(text_source_t *source, char *text, size_t *length) {
    const char *utf16 = NULL;
    if (*length >= 2 && memcmp(text, "\xff\xfe", 2) == 0) {
        utf16 = "UTF-16LE";
    } else if (*length >= 2 && memcmp(text, "\xfe\xff", 2) == 0) {
        utf16 = "UTF-16BE";
    } else {
        utf16 = utf16_without_mark(text, *length);
    }
    source->encoding = "UTF-8";
    if (utf16 != NULL) {
        source->encoding = "UTF-16";
        text = convert(text, length, utf16);
    } else if (!is_utf8(text, *length)) {
        const encoding_t *const encoding = most_known(text, *length);
        source->encoding = encoding->shown;
        text = convert(text, length, encoding->name);
    }
    if (text != NULL && *length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        *length -= 3;
        memmove(text, text + 3, *length + 1);
    }
    if (text != NULL) {
        cut_padding(text, length);
        repair_signs(text, length);
    }
    return text;
}

static void add_line(text_source_t *source, size_t *room, char *line) {
    if (source->lines == *room) {
        *room = *room > 0 ? 2 * *room : 4096;
        source->line = reallocate(source->line, *room, sizeof *source->line);
    }
    source->line[source->lines++] = line;
}

/* Whether the line break at `end` stands within a field in quotes, as spreadsheets write names of two lines: the field
 * begins on the line, and ends soon. */
static bool is_in_quotes(const char *begin, const char *end) {
    static const char separators[] = ",;\t|";
    const char *last = NULL;
    size_t quotes = 0;
    for (const char *at = begin; (at = memchr(at, '"', (size_t)(end - at))) != NULL; at++) {
        last = at;
        quotes++;
    }
    if (quotes % 2 == 0 || (last > begin && strchr(separators, last[-1]) == NULL)) {
        return false;
    }
    const size_t more = strcspn(end, "\"");
    const char *const close = end + more;
    return more < QUOTED && *close == '"' && (close[1] == '\0' || strchr(",;\t|\r\n", close[1]) != NULL);
}

/* A line break within quotes is a blank; empty lines then stand behind that line, so that later ones keep their
 * numbers. */
static bool split_lines(text_source_t *source, size_t length, const char *path, failure_t *failure) {
    size_t room = 0, begin = 0, joined = 0;
    for (size_t i = 0; i <= length; i++) {
        const char c = source->text[i];
        const bool end = i == length || c == '\n' || c == '\r';
        if (!end && ((unsigned char)c < 0x20 || c == 0x7F) && c != '\t') {
            return fail(failure, "%s:%zu: binary data, not a table of numbers: export it as text (CSV)", path,
                        source->lines + 1);
        }
        if (!end) {
            continue;
        }
        if (i == length && i == begin) {
            break; /* the last line ended */
        }
        const bool pair = c == '\r' && i < length && source->text[i + 1] == '\n';
        if (i < length && is_in_quotes(source->text + begin, source->text + i)) {
            source->text[i] = ' ';
            source->text[i + (pair ? 1 : 0)] = ' ';
            joined++;
            continue;
        }
        source->text[i] = '\0';
        add_line(source, &room, source->text + begin);
        for (; joined > 0; joined--) {
            add_line(source, &room, source->blank);
        }
        i += pair ? 1 : 0;
        begin = i + 1;
    }
    return true;
}

bool text_source_read(text_source_t *source, const char *path, failure_t *failure) {
    size_t length;
    memset(source, 0, sizeof *source);
    source->text = read_all(path, &length, &source->compressed, failure);
    if (source->text == NULL) {
        return false;
    }
    source->text = to_utf8(source, source->text, &length);
    if (source->text == NULL) {
        return fail(failure, "%s:1: binary data, not a table of numbers: export it as text (CSV)", path);
    }
    if (!split_lines(source, length, path, failure)) {
        text_source_free(source);
        return false;
    }
    return true;
}

void text_source_free(text_source_t *source) {
    free(source->line);
    free(source->text);
    free(source->joined);
    memset(source, 0, sizeof *source);
}
