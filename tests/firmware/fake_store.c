/* SPDX-License-Identifier: MIT */
#include "fake_board.h"
#include <string.h>

fake_store_t fake_store;
static uint32_t (*chance)(void);

void fake_store_clear(void) {
    memset(&fake_store, 0, sizeof fake_store);
    memset(fake_store.words, 0xFF, sizeof fake_store.words);
}

void fake_store_cut_after(unsigned steps, uint32_t (*random)(void)) {
    chance = random;
    fake_store.cutting = true;
    fake_store.dead = false;
    fake_store.steps_left = steps;
}

bool fake_store_power_on(void) {
    const bool was_dead = fake_store.dead;
    fake_store.cutting = fake_store.dead = false;
    return was_dead;
}

/* Is this the step in which the supply goes? */
static bool cut_now(void) {
    if (fake_store.after_each_step != NULL) {
        fake_store.after_each_step();
    }
    if (fake_store.cutting && fake_store.steps_left == 0) {
        fake_store.dead = true;
        return true;
    }
    fake_store.steps_left -= fake_store.cutting ? 1U : 0U;
    return false;
}

const uint32_t *board_store_sector(unsigned sector) {
    return fake_store.words[sector];
}

bool board_store_erase(unsigned sector) {
    if (fake_store.dead) {
        return false;
    }
    const bool cut = cut_now();
    fake_store.erasures++;
    for (size_t i = 0; i < BOARD_STORE_WORDS; i++) {
        const uint32_t fate = cut ? chance() % 3U : 0U;
        fake_store.words[sector][i] |= fate == 0 ? UINT32_MAX : fate == 1 ? 0U : chance();
    }
    return !cut;
}

bool board_store_program(unsigned sector, size_t word, uint32_t value) {
    if (fake_store.dead) {
        return false;
    }
    const bool cut = cut_now();
    if (!fake_store.stuck || fake_store.stuck_word != word) {
        fake_store.words[sector][word] &= cut ? value | chance() : value;
    }
    return !cut;
}
