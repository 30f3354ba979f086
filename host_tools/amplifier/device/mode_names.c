/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/mode_names.h"
#include "hyst/compensator.h"
#include "loop/telemetry.h"
#include <stdio.h>

const char *mode_name(int64_t mode) {
    static const char *const names[] = {
        [HYST_MODE_PARK] = "park",
        [HYST_MODE_DIRECT] = "direct",
        [HYST_MODE_LINEAR] = "linear",
        [HYST_MODE_COMPENSATE] = "compensate",
    };
    return mode >= HYST_MODE_PARK && mode <= HYST_MODE_COMPENSATE ? names[mode] : "unknown mode";
}

const char *state_name(int64_t state) {
    static const char *const names[] = {
        [LOOP_IDLE] = "idle",
        [LOOP_PLAYING] = "playing",
        [LOOP_CONDITIONING] = "conditioning",
        [LOOP_PARKED] = "parked",
    };
    return state >= LOOP_IDLE && state <= LOOP_PARKED ? names[state] : "unknown state";
}

const char *power_name(int64_t state) {
    static const char *const names[] = {
        [AMPLIFIER_OFF] = "off",
        [AMPLIFIER_PRECHARGE] = "in precharge",
        [AMPLIFIER_CONDITIONING] = "conditioning",
        [AMPLIFIER_HOLD] = "on",
        [AMPLIFIER_RUN] = "on",
        [AMPLIFIER_STOP] = "stopping",
        [AMPLIFIER_FAULT] = "in fault",
    };
    return state >= AMPLIFIER_OFF && state <= AMPLIFIER_FAULT ? names[state] : "in an unknown state";
}

/* By bit; registers.def explains them. */
const char *fault_name(unsigned bit) {
    static const char *const names[] = {"overrun",
                                        "converter timeout",
                                        "communication timeout",
                                        "clock fallback",
                                        "overload",
                                        "supply too low or too high",
                                        "average current too high",
                                        "temperature",
                                        "supply of the stage",
                                        "image changed in memory",
                                        "main loop stood still",
                                        "drive converter stuck"};
    return bit < sizeof names / sizeof names[0] ? names[bit] : NULL;
}

const char *faults_text(int64_t faults, char text[FAULTS_TEXT]) {
    size_t length = 0;
    (void)snprintf(text, FAULTS_TEXT, "none");
    for (unsigned bit = 0; bit < FAULT_BITS; bit++) {
        if ((faults >> bit & 1) == 0 || length >= FAULTS_TEXT) {
            continue;
        }
        const char *const comma = length > 0 ? ", " : "", *const name = fault_name(bit);
        const int more = name != NULL
                             ? snprintf(text + length, FAULTS_TEXT - length, "%s%s", comma, name)
                             : snprintf(text + length, FAULTS_TEXT - length, "%sunknown (%u)", comma, 1U << bit);
        length += more > 0 ? (size_t)more : 0;
    }
    return text;
}
