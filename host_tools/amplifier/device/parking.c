/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/parking.h"
#include "amplifier/device/device_state.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/register_words.h"
#include "loop/telemetry.h"

bool parking_fail(int64_t faults, failure_t *failure) {
    char text[FAULTS_TEXT];
    return fail(failure, "the amplifier has parked (faults: %s): somebody else, or its watchdog, stopped the run",
                faults_text(faults, text));
}

bool parking_is_off(int64_t amplifier_state) {
    return amplifier_state == AMPLIFIER_FAULT || amplifier_state == AMPLIFIER_OFF || amplifier_state == AMPLIFIER_STOP;
}

void parking_blame(device_t *device, bool was_start, failure_t *failure) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored;
    if (device->armed && register_words_read(&device->line, INDEX_sequence, INDEX_amplifier_state, now, &ignored) &&
        (parking_is_off(now[INDEX_amplifier_state]) || (was_start && now[INDEX_state] == LOOP_PARKED))) {
        (void)parking_fail(now[INDEX_faults_sticky], failure);
    }
}
