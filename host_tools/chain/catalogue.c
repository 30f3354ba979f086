/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/catalogue.h"
#include <string.h>

#define BLOCK_ADDRESS(name) &block_##name,
const block_t *const catalogue[] = {BLOCK_LIST(BLOCK_ADDRESS)};
const size_t catalogue_count = sizeof catalogue / sizeof catalogue[0];

const block_t *catalogue_find(const char *name) {
    for (size_t i = 0; i < catalogue_count; i++) {
        if (strcmp(catalogue[i]->name, name) == 0) {
            return catalogue[i];
        }
    }
    return NULL;
}

const char *place_name(place_t place) {
    static const char *const names[PLACE_COUNT] = {"electronics", "hysteresis", "slow", "mechanics", "sensor"};
    return names[place];
}
