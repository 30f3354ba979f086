/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Address, rate and parity that the amplifier has stored for its Modbus line. */
#ifndef LINE_CHANGE_H
#define LINE_CHANGE_H

#include "amplifier/device/device.h"

/** As its registers say them: in force, unless a master has noted others since. */
bool line_read(device_t *device, line_settings_t *line, failure_t *failure);

/**
 * Stores these settings in the amplifier that answers at *now, which has to be off, and asks it at the new ones whether
 * it has them. A lost answer is none lost then, also where these are the settings that it has already. Where it does
 * not answer there, the old ones are tried, and the failure says which it has. Where it answers nowhere, the failure
 * says which two it can have and what to do.
 */
bool line_change(const device_options_t *now, const line_settings_t *line, failure_t *failure);

#endif
