/* SPDX-License-Identifier: MIT */
#include "registers/register_table.h"
#include "board_list.h"
#include <string.h>

const register_info_t register_table[REGISTER_COUNT] = {
#define REGISTER(name, address, type, access, unit, text)                                                              \
    {#name, address, REGISTER_##type, REGISTER_##access, unit, text},
#include "registers/registers.def"
};

const register_block_info_t register_blocks[] = {
#define BLOCK(name, address, registers, access, text) {#name, address, registers, REGISTER_##access, text},
#include "registers/registers.def"
};
const size_t register_block_count = sizeof register_blocks / sizeof register_blocks[0];

const register_info_t *register_find(const char *name) {
    for (size_t i = 0; i < REGISTER_COUNT; i++) {
        if (strcmp(register_table[i].name, name) == 0) {
            return &register_table[i];
        }
    }
    return NULL;
}

const register_block_info_t *register_find_block(const char *name) {
    for (size_t i = 0; i < register_block_count; i++) {
        if (strcmp(register_blocks[i].name, name) == 0) {
            return &register_blocks[i];
        }
    }
    return NULL;
}

const char *board_name(int64_t id) {
    switch (id) {
#define BOARD_CASE(number, text)                                                                                       \
    case number:                                                                                                       \
        return text;
        BOARD_LIST(BOARD_CASE)
#undef BOARD_CASE
    default:
        return NULL;
    }
}
