/* SPDX-License-Identifier: GPL-3.0-or-later */
/** From off to ready, and what has to be off. */
#ifndef ARMING_H
#define ARMING_H

#include "amplifier/device/device.h"

/**
 * Makes the amplifier ready to move: out of a fault if there is one, unlocked, communication timeout long enough for
 * the repetitions of this device, armed, and waits until it holds. Refused when no image was pushed since it started,
 * and when somebody else disarms it meanwhile.
 */
bool device_arm(device_t *device, failure_t *failure);

/** Fails, with what to do, unless the amplifier is off; `what` it would store then. Waits for one that is on its way
 * there, as after a run. */
bool device_expect_off(device_t *device, const char *what, failure_t *failure);

#endif
