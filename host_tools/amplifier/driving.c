/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/driving.h"
#include "amplifier/mode_names.h"
#include "base/monotonic_clock.h"
#include "base/stop_signal.h"
#include "telemetry.h"

bool driving_begin(driving_t *driving, device_t *device, const volatile sig_atomic_t *stop, failure_t *failure) {
    *driving = (driving_t){.device = device,
                           .stop = stop != NULL ? stop : stop_on_signal(),
                           .timeout_ms = device_communication_timeout_ms(device)};
    device_stop_when(device, driving->stop);
    return device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, failure) &&
           device_read(device, INDEX_watchdog, &driving->timeout_before_ms, failure) &&
           device_write(device, INDEX_watchdog, driving->timeout_ms, failure);
}

/* The first failure remains the one that is reported. */
static void park(const driving_t *driving, failure_t *failure) {
    failure_t ignored;
    const failure_t first = *failure;
    const int part = (int)(sizeof first.text - 200);
    if (device_command(driving->device, COMMAND_PARK, &ignored)) {
        (void)device_write(driving->device, INDEX_watchdog, driving->timeout_before_ms, &ignored);
        (void)fail(failure, "%.*s; the drive is stopped and parked", part, first.text);
    } else {
        (void)fail(
            failure,
            "%.*s; the amplifier did not take the command to park: without requests it parks by itself after %g s",
            part, first.text, (double)driving->timeout_ms / 1000.0);
    }
}

bool driving_end(driving_t *driving, bool good, failure_t *failure) {
    good = good && device_write(driving->device, INDEX_watchdog, driving->timeout_before_ms, failure);
    device_stop_when(driving->device, NULL);
    if (*driving->stop != 0) {
        good = fail(failure, "interrupted (%s)", stop_signal_name(*driving->stop));
    }
    if (!good) {
        park(driving, failure);
    }
    device_lock(driving->device);
    return good;
}

/* A command takes effect with the next sample; an emulated amplifier may take its time for that. */
#define HALT_S 5.0
#define POLL_S 0.05

bool driving_halt(device_t *device, control_command_t command, int64_t now[REGISTER_COUNT], failure_t *failure) {
    if (!device_command(device, command, failure)) {
        return false;
    }
    for (const double until_s = monotonic_s() + HALT_S; monotonic_s() < until_s; sleep_until(monotonic_s() + POLL_S)) {
        if (!device_read_telemetry(device, now, failure)) {
            return false;
        }
        const int64_t state = now[INDEX_state];
        if (state == LOOP_PARKED || (command == COMMAND_STOP && state == LOOP_IDLE)) {
            return true;
        }
    }
    return fail(failure, "the amplifier has taken the command, but after %g s its loop is still %s", HALT_S,
                state_name(now[INDEX_state]));
}
