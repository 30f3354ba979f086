/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/driving.h"
#include "amplifier/device/restart.h"
#include "base/monotonic_clock.h"
#include "base/stop_signal.h"
#include "loop/telemetry.h"
#include <math.h>
#include <stdio.h>

/* As a good run ends: to park, and then off. The first failure remains the one that is reported, unless a restart of
 * the amplifier is the cause; what parks it comes before that is looked at. timeout_ms: the longest it may have now. */
static void park(device_t *device, int64_t timeout_before_ms, int64_t timeout_ms, bool interrupted,
                 failure_t *failure) {
    failure_t ignored;
    failure_t first = *failure;
    const int part = (int)(sizeof first.text - 200);
    device_clean_up_begin(device);
    if (device_command(device, COMMAND_DISARM, &ignored)) {
        (void)device_write(device, INDEX_watchdog, timeout_before_ms, &ignored);
        if (!interrupted) {
            device_blame_restart(device, &first);
        }
        (void)fail(failure, "%.*s; the drive is stopped and parked", part, first.text);
    } else {
        (void)fail(
            failure,
            "%.*s; the amplifier did not take the command to park: without requests it parks by itself after %g s",
            part, first.text, (double)timeout_ms / 1000.0);
    }
    device_clean_up_end(device);
}

bool driving_run(device_t *device, const driving_t *driving, failure_t *failure) {
    const volatile sig_atomic_t *stop = driving->stop != NULL ? driving->stop : stop_on_signal();
    int64_t before_ms = 0; /* 0: off */
    device_stop_when(device, stop);
    device_note_start(device);
    if (!device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, failure) ||
        !device_read(device, INDEX_watchdog, &before_ms, failure) ||
        !device_write(device, INDEX_watchdog, device_communication_timeout_ms(device), failure)) {
        device_stop_when(device, NULL); /* what comes next, and the caller's own, is not to be interrupted */
        device_lock(device);
        return false;
    }
    const int64_t after_ms = driving->silence_s > 0.0 ? (int64_t)lround(1000.0 * driving->silence_s) : before_ms;
    const bool played = driving->play(device, driving->context, failure);
    bool good = played && device_write(device, INDEX_watchdog, after_ms, failure);
    device_stop_when(device, NULL);
    if (*stop != 0) {
        good = fail(failure, "interrupted (%s)", stop_signal_name(*stop));
    }
    if (!good) {
        const int64_t armed_ms = device_communication_timeout_ms(device);
        park(device, before_ms, played && after_ms > armed_ms ? after_ms : armed_ms, *stop != 0, failure);
    }
    device_lock(device);
    return good;
}

driving_fault_t driving_fault(int64_t tripped) {
    driving_fault_t fault;
    char faults[FAULTS_TEXT];
    (void)snprintf(fault.text, sizeof fault.text, "the amplifier had tripped (%s); this leads it out of that fault",
                   faults_text(tripped, faults));
    return fault;
}

void driving_keep_fault(void *context, int64_t tripped) {
    driving_fault_t *const fault = context;
    *fault = driving_fault(tripped);
}

/* A command takes effect with the next sample; an emulated amplifier may take its time for that. */
#define HALT_S 5.0
/* A ramp over the whole range takes a board at most 10 s (hyst/board_limits.h). */
#define OFF_S  12.0
#define POLL_S 0.05

static bool is_halted(control_command_t command, const int64_t now[REGISTER_COUNT]) {
    const int64_t state = now[INDEX_state];
    switch (command) {
    case COMMAND_DISARM: /* a fault has the stage disabled, and keeps it so */
        return state == LOOP_PARKED &&
               (now[INDEX_amplifier_state] == AMPLIFIER_OFF || now[INDEX_amplifier_state] == AMPLIFIER_FAULT);
    case COMMAND_STOP: /* leads out of a fault */
        return (state == LOOP_PARKED || state == LOOP_IDLE) && now[INDEX_amplifier_state] != AMPLIFIER_FAULT;
    default:
        return state == LOOP_PARKED;
    }
}

/* Until it has taken effect. */
static bool wait_for_halt(device_t *device, control_command_t command, int64_t now[REGISTER_COUNT],
                          failure_t *failure) {
    const double patience_s = command == COMMAND_DISARM ? OFF_S : HALT_S;
    for (const double until_s = monotonic_s() + patience_s; monotonic_s() < until_s;
         sleep_until(monotonic_s() + POLL_S)) {
        if (!device_read_telemetry(device, now, failure)) {
            return false;
        }
        if (is_halted(command, now)) {
            return true;
        }
    }
    return fail(failure, "the amplifier has taken the command, but after %g s its loop is still %s, and it is %s",
                patience_s, state_name(now[INDEX_state]), power_name(now[INDEX_amplifier_state]));
}

bool driving_halt(device_t *device, control_command_t command, int64_t now[REGISTER_COUNT], failure_t *failure) {
    return device_command(device, command, failure) &&
           (!device_map_known(device) || wait_for_halt(device, command, now, failure));
}
