/* SPDX-License-Identifier: MIT */
#include "image_store.h"
#include "board.h"
#include "hyst/parameters.h"
#include <string.h>

#define STORE_MAGIC  0x48595053U /* "HYPS" */
#define STORE_LAYOUT 2U

/* Places in a sector. */
enum { WORD_MAGIC, WORD_LAYOUT, WORD_SEQUENCE, WORD_LENGTH, WORD_LINE, WORD_BAUD, WORD_IMAGE };

/* The layout before: no settings of the line. */
#define OLD_LAYOUT     1U
#define OLD_WORD_IMAGE 4U

#define PARITY_SHIFT 8U
#define BYTE_MASK    0xFFU

_Static_assert(WORD_IMAGE + HYST_IMAGE_MAX_WORDS + 1U <= BOARD_STORE_WORDS, "the longest image fits");

static unsigned image_at(const uint32_t *sector) {
    return sector[WORD_LAYOUT] == OLD_LAYOUT ? OLD_WORD_IMAGE : (unsigned)WORD_IMAGE;
}

static bool whole(const uint32_t *sector) {
    if (sector[WORD_MAGIC] != STORE_MAGIC ||
        (sector[WORD_LAYOUT] != STORE_LAYOUT && sector[WORD_LAYOUT] != OLD_LAYOUT) ||
        sector[WORD_LENGTH] > HYST_IMAGE_MAX_WORDS) {
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

line_settings_t image_store_line(void) {
    const uint32_t *from = newest_copy();
    if (from == NULL || from[WORD_LAYOUT] == OLD_LAYOUT) {
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

static bool program(unsigned sector, const uint32_t header[WORD_IMAGE], const uint32_t *image, size_t length) {
    bool ok = true;
    for (size_t i = 0; ok && i < WORD_IMAGE; i++) {
        ok = board_store_program(sector, i, header[i]);
    }
    for (size_t i = 0; ok && i < length; i++) {
        ok = board_store_program(sector, WORD_IMAGE + i, image[i]);
    }
    /* Of what the flash holds, so that what it did not take shows. */
    const uint32_t *written = board_store_sector(sector);
    return ok && memcmp(written, header, WORD_IMAGE * sizeof header[0]) == 0 &&
           (length == 0 || memcmp(written + WORD_IMAGE, image, length * sizeof image[0]) == 0) &&
           board_store_program(sector, WORD_IMAGE + length, hyst_crc32(written, WORD_IMAGE + length));
}

/* The image may lie in the newest copy, which is not touched. */
static bool save(const uint32_t *image, size_t length, const line_settings_t *line) {
    const unsigned sector = newest() == 0 ? 1 : 0;
    const uint32_t header[WORD_IMAGE] = {STORE_MAGIC,
                                         STORE_LAYOUT,
                                         image_store_sequence() + 1U,
                                         (uint32_t)length,
                                         line->address | line->parity << PARITY_SHIFT,
                                         line->baud};
    return board_store_erase(sector) && program(sector, header, image, length) && newest() == sector;
}

bool image_store_save(const uint32_t *image, size_t length) {
    const line_settings_t line = image_store_line();
    return length <= HYST_IMAGE_MAX_WORDS && save(image, length, &line);
}

bool image_store_save_line(const line_settings_t *line) {
    const uint32_t *from = newest_copy();
    return from == NULL ? save(NULL, 0, line) : save(from + image_at(from), from[WORD_LENGTH], line);
}
