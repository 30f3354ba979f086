/* SPDX-License-Identifier: MIT */
/* The part of board.h that belongs to the processor core rather than to a board. */
#include "board.h"

/* Every board has a periodic interrupt, of 1 ms or less, that ends the sleep. */
void board_idle(void) {
    __asm__ volatile("wfi");
}

uint32_t board_lock(void) {
    uint32_t primask;
    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(primask)::"memory");
    return primask;
}

void board_unlock(uint32_t key) {
    __asm__ volatile("msr primask, %0" ::"r"(key) : "memory");
}
