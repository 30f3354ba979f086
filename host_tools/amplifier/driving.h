/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Guards everything that a command plays, so that no error leaves the actuator driven.
 *
 * Between driving_begin and driving_end the amplifier is unlocked, and SIGINT, SIGTERM and SIGHUP make the next request
 * fail, and a failure of any kind ends with the source stopped and the amplifier parked. Meanwhile the amplifier's
 * communication timeout (register `watchdog`) is armed, so that it parks by itself when this process is killed or the
 * line is cut.
 */
#ifndef DRIVING_H
#define DRIVING_H

#include "amplifier/device.h"

typedef struct {
    device_t *device;
    const volatile sig_atomic_t *stop;
    int64_t timeout_before_ms; /**< register `watchdog` as it was found; 0: off */
    int64_t timeout_ms;        /**< its value while driving */
} driving_t;

/**
 * Catches the signals and sets the communication timeout (device_communication_timeout_ms). Call it before any command.
 * stop: for a program that takes its signals itself, a flag that it sets to the number of one; NULL: catch them.
 */
bool driving_begin(driving_t *driving, device_t *device, const volatile sig_atomic_t *stop, failure_t *failure);

/**
 * Must follow every successful driving_begin. `good`: success, so the amplifier stays as it is and gets back its
 * previous communication timeout. Otherwise, or after a signal, stops and parks it, and appends that to *failure.
 * Returns whether all is well.
 */
bool driving_end(driving_t *driving, bool good, failure_t *failure);

/**
 * COMMAND_STOP or COMMAND_PARK for an amplifier that was left driven. Waits until its loop no longer plays, or is
 * parked. now: the snapshot that shows it.
 */
bool driving_halt(device_t *device, control_command_t command, int64_t now[REGISTER_COUNT], failure_t *failure);

#endif
