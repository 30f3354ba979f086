/* SPDX-License-Identifier: MIT */
#include "image_store.h"
#include "board.h"
#include "hyst/parameters.h"
#include <string.h>

#define STORE_MAGIC  0x48595053U /* "HYPS" */
#define STORE_LAYOUT 1U

/* Places in a sector. */
enum { WORD_MAGIC, WORD_LAYOUT, WORD_SEQUENCE, WORD_LENGTH, WORD_IMAGE };

_Static_assert(WORD_IMAGE + HYST_IMAGE_MAX_WORDS + 1U <= BOARD_STORE_WORDS, "the longest image fits");

static bool whole(const uint32_t *sector) {
    return sector[WORD_MAGIC] == STORE_MAGIC && sector[WORD_LAYOUT] == STORE_LAYOUT &&
           sector[WORD_LENGTH] <= HYST_IMAGE_MAX_WORDS &&
           hyst_crc32(sector, WORD_IMAGE + sector[WORD_LENGTH]) == sector[WORD_IMAGE + sector[WORD_LENGTH]];
}

/* The sector with the newest whole copy, or BOARD_STORE_SECTORS. Numbers wrap: the newer is the one a step ahead. */
static unsigned newest(void) {
    const uint32_t *first = board_store_sector(0), *second = board_store_sector(1);
    if (!whole(first)) {
        return whole(second) ? 1 : BOARD_STORE_SECTORS;
    }
    return whole(second) && second[WORD_SEQUENCE] - first[WORD_SEQUENCE] < 0x80000000U ? 1 : 0;
}

size_t image_store_load(uint32_t *image, size_t capacity, uint32_t *sequence) {
    const unsigned sector = newest();
    if (sector == BOARD_STORE_SECTORS) {
        return 0;
    }
    const uint32_t *from = board_store_sector(sector);
    const size_t length = from[WORD_LENGTH];
    if (length > capacity) {
        return 0;
    }
    memcpy(image, from + WORD_IMAGE, length * sizeof image[0]);
    if (sequence != NULL) {
        *sequence = from[WORD_SEQUENCE];
    }
    return length;
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
           memcmp(written + WORD_IMAGE, image, length * sizeof image[0]) == 0 &&
           board_store_program(sector, WORD_IMAGE + length, hyst_crc32(written, WORD_IMAGE + length));
}

bool image_store_save(const uint32_t *image, size_t length) {
    if (length > HYST_IMAGE_MAX_WORDS) {
        return false;
    }
    const unsigned old = newest();
    const unsigned sector = old == 0 ? 1 : 0;
    const uint32_t sequence = old == BOARD_STORE_SECTORS ? 1U : board_store_sector(old)[WORD_SEQUENCE] + 1U;
    const uint32_t header[WORD_IMAGE] = {STORE_MAGIC, STORE_LAYOUT, sequence, (uint32_t)length};
    return board_store_erase(sector) && program(sector, header, image, length) && newest() == sector;
}
