/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Guards everything that is played, so that no error leaves the actuator driven.
 *
 * While it plays the amplifier is unlocked, and SIGINT, SIGTERM and SIGHUP make the next request fail. A failure of any
 * kind ends as a good run does: the source stopped, the drive on its way to park, and the amplifier off there.
 * Meanwhile the amplifier's communication timeout (register `watchdog`) is armed, so that it parks by itself when this
 * process is killed or the line is cut.
 */
#ifndef DRIVING_H
#define DRIVING_H

#include "amplifier/device/device.h"
#include "amplifier/device/mode_names.h"

typedef struct {
    bool (*play)(device_t *device, void *context, failure_t *failure);
    void *context;
    const volatile sig_atomic_t *stop; /**< of a program that takes its signals itself: set to the number of one; NULL:
                                            they are caught here */
    double silence_s;                  /**< communication timeout after success; 0: the one that was found */
} driving_t;

/**
 * Sets the communication timeout (device_communication_timeout_ms) and plays. After success the amplifier stays as it
 * is. Otherwise, or after a signal, stops, parks and disarms it, and appends that to *failure; a restart of the
 * amplifier in between is then the failure. Where it cannot even be unlocked,
 * nothing was driven and nothing is parked. In any case it is locked again, and the signals no longer end requests.
 * Returns whether all is well.
 */
bool driving_run(device_t *device, const driving_t *driving, failure_t *failure);

/** A line about the fault that something leads the amplifier out of; "": none. */
typedef struct {
    char text[100 + FAULTS_TEXT];
} driving_fault_t;

/** What had tripped, of the bits of faults_sticky. */
driving_fault_t driving_fault(int64_t tripped);

/** A device_left_fault_t whose context is a driving_fault_t: it receives the line. */
void driving_keep_fault(void *context, int64_t tripped);

/**
 * COMMAND_STOP, COMMAND_PARK or COMMAND_DISARM for an amplifier that was left driven. Waits until its loop no longer
 * plays, or is parked, or it is off. now: the snapshot that shows it. One with an unknown map gets the command, and is
 * not looked at: *now is not filled.
 */
bool driving_halt(device_t *device, control_command_t command, int64_t now[REGISTER_COUNT], failure_t *failure);

#endif
