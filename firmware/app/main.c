/* SPDX-License-Identifier: MIT */
#include "amplifier.h"
#include "board.h"
#include "loop/loop.h"

int main(void) {
    const board_start_t start = board_init();
    amplifier_init(&start);
    board_start(loop_park_code());
    for (;;) {
        if (!amplifier_serve()) {
            board_idle();
        }
    }
}
