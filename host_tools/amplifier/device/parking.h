/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The amplifier parks while it is driven from here: another master, a fault or its watchdog has ended what went on. */
#ifndef PARKING_H
#define PARKING_H

#include "amplifier/device/device_type.h"
#include "base/failure.h"
#include <stdint.h>

/** Says so, with the faults that it has seen (faults_sticky). Always false. */
bool parking_fail(int64_t faults, failure_t *failure);

/** Whether this amplifier_state is on the way off, or off: not what was armed. */
bool parking_is_off(int64_t amplifier_state);

/** *failure, which is of a request that was refused, becomes the parking that caused it, if the amplifier was armed
 * here and is off now, or on its way there. was_start: nothing starts while it is parked, either. */
void parking_blame(device_t *device, bool was_start, failure_t *failure);

#endif
