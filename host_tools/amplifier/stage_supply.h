/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The supply of the power stage, as far as the board measures it (register high_voltage). */
#ifndef STAGE_SUPPLY_H
#define STAGE_SUPPLY_H

#include "recording/recording.h"
#include <stdint.h>

/** A reading of the register in V. NAN: the board has no such sensor, or no reading yet. */
double stage_supply_v(int64_t reading);

/** Into the recording's header (STAGE_SUPPLY_KEY). Nothing where it is not above 0 V, or NAN. */
void stage_supply_note(recording_t *recording, double supply_v);

#endif
