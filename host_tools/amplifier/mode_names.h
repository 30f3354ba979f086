/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Names of the values of two enumerated registers. Never NULL. */
#ifndef MODE_NAMES_H
#define MODE_NAMES_H

#include <stdint.h>

/** Register `mode`: "park", "direct", "linear", "compensate". */
const char *mode_name(int64_t mode);

/** Register `state`: "idle", "playing", "conditioning", "parked". */
const char *state_name(int64_t state);
/** Of register `amplifier_state`. */
const char *power_name(int64_t state);

#endif
