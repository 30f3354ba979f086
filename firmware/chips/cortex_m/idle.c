/* SPDX-License-Identifier: MIT */
/* For the boards that have no more to do then; a file to itself, as one that has defines its own. */
#include "board.h"

/* Every board has a periodic interrupt, of 1 ms or less, that ends the sleep. */
void board_idle(void) {
    __asm__ volatile("wfi");
}
