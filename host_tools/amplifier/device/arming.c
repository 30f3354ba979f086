/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/arming.h"
#include "amplifier/device/device_state.h"
#include "amplifier/device/mode_names.h"
#include "amplifier/device/restart.h"
#include "amplifier/device/sample_number.h"
#include "amplifier/device/standstill.h"
#include "base/monotonic_clock.h"
#include "loop/telemetry.h"

/* A ramp over the whole range takes a board at most 10 s (hyst/board_limits.h). */
#define PARKED_S 12.0
#define POLL_S   0.02

bool device_expect_off(device_t *device, const char *what, failure_t *failure) {
    const double until_s = monotonic_s() + PARKED_S;
    int64_t state = AMPLIFIER_STOP;
    bool read = device_read(device, INDEX_amplifier_state, &state, failure);
    while (read && state == AMPLIFIER_STOP && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + POLL_S);
        read = device_read(device, INDEX_amplifier_state, &state, failure);
    }
    return read &&
           (state == AMPLIFIER_OFF ||
            fail(failure, "the amplifier is on, and stores %s only while it is off: disarm it (command 10)", what));
}

/* Precharge waits for the end of a ramp, and then for its self test, 1 s at most, in the loop's time (REGISTERS). */
#define PRECHARGE_S (PARKED_S + 1.0)

/* From STOP on, which leads out of a fault. */
static bool command_arm(device_t *device, failure_t *failure) {
    return device_command(device, COMMAND_STOP, failure) &&
           device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, failure) &&
           device_write(device, INDEX_watchdog, device_communication_timeout_ms(device), failure) &&
           (device_command(device, COMMAND_ARM, failure) ||
            fail_in(failure, "the amplifier cannot be armed: was an image pushed since it started?"));
}

/* What a sample after the arming says: that it cannot come to its end any more. */
static bool check_arming(device_t *device, const int64_t now[REGISTER_COUNT], failure_t *failure) {
    const int64_t power = now[INDEX_amplifier_state];
    char faults[FAULTS_TEXT];
    if (power == AMPLIFIER_FAULT) {
        return fail(failure, "%s: the amplifier trips as soon as it is armed: %s", device->line.port,
                    faults_text(now[INDEX_faults_live], faults));
    }
    return (power != AMPLIFIER_OFF && power != AMPLIFIER_STOP) ||
           (device_check_start(device, failure) &&
            fail(failure, "%s: somebody else has switched the amplifier off while it was armed here",
                 device->line.port));
}

/* Waits for the end of precharge, from the sample `first` on. */
static bool wait_for_precharge(device_t *device, int64_t first, failure_t *failure) {
    const double most = PRECHARGE_S * device_sample_rate_hz(device);
    int64_t now[REGISTER_COUNT], sample = first;
    standstill_t standstill = standstill_begin(first);
    while ((double)samples_between(first, sample) < most) {
        sleep_until(monotonic_s() + POLL_S);
        if (!device_read_span(device, INDEX_sequence, INDEX_amplifier_state, now, failure) ||
            !standstill_check(&standstill, now[INDEX_sequence], failure)) {
            return false;
        }
        const bool newer = now[INDEX_sequence] != sample;
        sample = now[INDEX_sequence];
        if (newer && !check_arming(device, now, failure)) {
            return false;
        }
        if (newer && now[INDEX_amplifier_state] != AMPLIFIER_PRECHARGE) {
            return true;
        }
    }
    return fail(failure,
                "%s: the amplifier is still in precharge after %g s of its time: does somebody else arm it anew?",
                device->line.port, PRECHARGE_S);
}

/* Telemetry is of the newest sample, which may be older than the command: only what a later one says counts. */
bool device_arm(device_t *device, failure_t *failure) {
    int64_t first;
    device->armed = false;
    device->armed = command_arm(device, failure) && device_read(device, INDEX_sequence, &first, failure) &&
                    wait_for_precharge(device, first, failure);
    return device->armed;
}
