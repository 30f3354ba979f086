/* SPDX-License-Identifier: MIT */
#include "amplifier.h"
#include "board.h"

int main(void) {
    amplifier_init(board_init());
    board_start();
    for (;;) {
        if (!amplifier_serve()) {
            board_idle();
        }
    }
}
