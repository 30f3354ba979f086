/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Whether the amplifier has started anew since something was set in it: then that is gone. */
#ifndef RESTART_H
#define RESTART_H

#include "amplifier/device/device_type.h"
#include "base/failure.h"

/** From now on a restart of the amplifier is one since now. device_open notes the first. */
void device_note_start(device_t *device);

/** Fails with "the amplifier restarted ..." if it has since then, and notes the new start: a restart is reported once.
 * Firmware that does not count its starts passes. */
bool device_check_start(device_t *device, failure_t *failure);

/** *failure, which is the reason of something that failed, becomes the restart that caused it, if there was one. A
 * request that is refused does this by itself. */
void device_blame_restart(device_t *device, failure_t *failure);

#endif
