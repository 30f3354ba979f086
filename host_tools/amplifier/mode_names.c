/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/mode_names.h"
#include "hyst/compensator.h"
#include "loop/telemetry.h"

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
