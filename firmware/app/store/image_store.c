/* SPDX-License-Identifier: MIT */
#include "store/image_store.h"
#include "board.h"
#include "hyst/parameters.h"
#include <string.h>

#define STORE_MAGIC  0x48595053U /* "HYPS" */
#define STORE_LAYOUT 3U

/* Places in a sector. */
enum { WORD_MAGIC, WORD_LAYOUT, WORD_SEQUENCE, WORD_LENGTH, WORD_LINE, WORD_BAUD, WORD_LIMITS, HEADER_WORDS };
#define WORDS_PER_LIMIT 2U

/* The layouts before, and where the image was. */
enum { LAYOUT_WITHOUT_LINE = 1, LAYOUT_WITHOUT_LIMITS = 2 };
#define IMAGE_WITHOUT_LINE   WORD_LINE
#define IMAGE_WITHOUT_LIMITS WORD_LIMITS

#define PARITY_SHIFT 8U
#define BYTE_MASK    0xFFU

_Static_assert(HEADER_WORDS + WORDS_PER_LIMIT * IMAGE_STORE_LIMITS_MAX + HYST_IMAGE_MAX_WORDS + 1U <= BOARD_STORE_WORDS,
               "the longest image fits");

/* What a copy holds beside its number. It may lie in flash. */
typedef struct {
    line_settings_t line;
    const uint32_t *limits, *image; /* in words */
    size_t limit_words, length;
} copy_t;

static size_t limits_of(const uint32_t *sector) {
    return sector[WORD_LAYOUT] == STORE_LAYOUT ? sector[WORD_LIMITS] : 0;
}

static size_t image_at(const uint32_t *sector) {
    switch (sector[WORD_LAYOUT]) {
    case LAYOUT_WITHOUT_LINE:
        return IMAGE_WITHOUT_LINE;
    case LAYOUT_WITHOUT_LIMITS:
        return IMAGE_WITHOUT_LIMITS;
    default:
        return HEADER_WORDS + WORDS_PER_LIMIT * limits_of(sector);
    }
}

static bool whole(const uint32_t *sector) {
    if (sector[WORD_MAGIC] != STORE_MAGIC || sector[WORD_LAYOUT] < LAYOUT_WITHOUT_LINE ||
        sector[WORD_LAYOUT] > STORE_LAYOUT || sector[WORD_LENGTH] > HYST_IMAGE_MAX_WORDS ||
        limits_of(sector) > IMAGE_STORE_LIMITS_MAX) {
        return false;
    }
    const size_t end = image_at(sector) + sector[WORD_LENGTH];
    return hyst_crc32(sector, end) == sector[end];
}

/* The sector with the newest whole copy, or BOARD_STORE_SECTORS. Numbers wrap: the newer is the one a step ahead. */
static unsigned newest(void) {
    const uint32_t *first = board_store_sector(0), *second = board_store_sector(1);
    if (!whole(first)) {
        return whole(second) ? 1 : BOARD_STORE_SECTORS;
    }
    return whole(second) && second[WORD_SEQUENCE] - first[WORD_SEQUENCE] < 0x80000000U ? 1 : 0;
}

/* NULL if there is none. */
static const uint32_t *newest_copy(void) {
    const unsigned sector = newest();
    return sector == BOARD_STORE_SECTORS ? NULL : board_store_sector(sector);
}

size_t image_store_load(uint32_t *image, size_t capacity) {
    const uint32_t *from = newest_copy();
    if (from == NULL || from[WORD_LENGTH] > capacity) {
        return 0;
    }
    memcpy(image, from + image_at(from), from[WORD_LENGTH] * sizeof image[0]);
    return from[WORD_LENGTH];
}

size_t image_store_limits(stored_limit_t limits[IMAGE_STORE_LIMITS_MAX]) {
    const uint32_t *from = newest_copy();
    const size_t count = from == NULL ? 0 : limits_of(from);
    for (size_t i = 0; i < count; i++) {
        const uint32_t *words = from + HEADER_WORDS + WORDS_PER_LIMIT * i;
        limits[i] = (stored_limit_t){.address = words[0], .value = words[1]};
    }
    return count;
}

line_settings_t image_store_line(void) {
    const uint32_t *from = newest_copy();
    if (from == NULL || from[WORD_LAYOUT] == LAYOUT_WITHOUT_LINE) {
        return (line_settings_t)LINE_SETTINGS_DEFAULT;
    }
    return (line_settings_t){.address = from[WORD_LINE] & BYTE_MASK,
                             .parity = from[WORD_LINE] >> PARITY_SHIFT & BYTE_MASK,
                             .baud = from[WORD_BAUD]};
}

uint32_t image_store_sequence(void) {
    const uint32_t *from = newest_copy();
    return from == NULL ? 0 : from[WORD_SEQUENCE];
}

/* These words from `at` on; `at` moves behind them. Read back, so that what the flash did not take shows. */
static bool program(unsigned sector, size_t *at, const uint32_t *words, size_t count) {
    const size_t first = *at;
    bool ok = true;
    for (size_t i = 0; ok && i < count; i++) {
        ok = board_store_program(sector, first + i, words[i]);
    }
    *at += count;
    return ok && (count == 0 || memcmp(board_store_sector(sector) + first, words, count * sizeof words[0]) == 0);
}

/* What the copy points to may lie in the newest one, which is not touched. The CRC is of what the flash holds. */
static bool save(const copy_t *copy) {
    const unsigned sector = newest() == 0 ? 1 : 0;
    const uint32_t header[HEADER_WORDS] = {STORE_MAGIC,
                                           STORE_LAYOUT,
                                           image_store_sequence() + 1U,
                                           (uint32_t)copy->length,
                                           copy->line.address | copy->line.parity << PARITY_SHIFT,
                                           copy->line.baud,
                                           (uint32_t)(copy->limit_words / WORDS_PER_LIMIT)};
    size_t at = 0;
    return board_store_erase(sector) && program(sector, &at, header, HEADER_WORDS) &&
           program(sector, &at, copy->limits, copy->limit_words) && program(sector, &at, copy->image, copy->length) &&
           board_store_program(sector, at, hyst_crc32(board_store_sector(sector), at)) && newest() == sector;
}

bool image_store_save(const uint32_t *image, size_t length, const stored_limit_t *limits, size_t limit_count) {
    uint32_t words[WORDS_PER_LIMIT * IMAGE_STORE_LIMITS_MAX];
    if (length > HYST_IMAGE_MAX_WORDS || limit_count > IMAGE_STORE_LIMITS_MAX) {
        return false;
    }
    for (size_t i = 0; i < limit_count; i++) {
        words[WORDS_PER_LIMIT * i] = limits[i].address;
        words[WORDS_PER_LIMIT * i + 1U] = limits[i].value;
    }
    return save(&(copy_t){.line = image_store_line(),
                          .limits = words,
                          .limit_words = WORDS_PER_LIMIT * limit_count,
                          .image = image,
                          .length = length});
}

bool image_store_save_line(const line_settings_t *line) {
    const uint32_t *from = newest_copy();
    copy_t copy = {.line = *line};
    if (from != NULL) {
        copy.limits = from + HEADER_WORDS;
        copy.limit_words = WORDS_PER_LIMIT * limits_of(from);
        copy.image = from + image_at(from);
        copy.length = from[WORD_LENGTH];
    }
    return save(&copy);
}
