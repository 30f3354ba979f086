/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/stage_supply.h"
#include "board.h"
#include <math.h>
#include <stdio.h>

double stage_supply_v(int64_t reading) {
    return reading == HEALTH_ABSENT ? (double)NAN : 1e-3 * (double)reading;
}

void stage_supply_note(recording_t *recording, double supply_v) {
    char text[32];
    if (supply_v > 0.0) {
        (void)snprintf(text, sizeof text, "%.3f", supply_v);
        recording_set_key(recording, STAGE_SUPPLY_KEY, text);
    }
}
