/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Names of the values of three enumerated registers, and of the bits of the faults. Never NULL. */
#ifndef MODE_NAMES_H
#define MODE_NAMES_H

#include <stddef.h>
#include <stdint.h>

/** Register `mode`: "park", "direct", "linear", "compensate". */
const char *mode_name(int64_t mode);

/** Register `state`: "idle", "playing", "conditioning", "parked". */
const char *state_name(int64_t state);
/** Of register `amplifier_state`. */
const char *power_name(int64_t state);

/** Of a bit of the registers `faults_live` and `faults_sticky`. NULL for one that only newer firmware has. */
const char *fault_name(unsigned bit);

enum { FAULT_BITS = 16, FAULTS_TEXT = 300 };

/** "overload, temperature"; "none". Faults without a name by their value: "unknown (1024)". Returns `text`. */
const char *faults_text(int64_t faults, char text[FAULTS_TEXT]);

#endif
