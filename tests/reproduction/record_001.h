/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Recordings of paper 001, made on its twin. */
#ifndef RECORD_001_H
#define RECORD_001_H

#include "recording/recording.h"
#include <stdint.h>

/** A sine of the drive around 0 V, and what the twin's sensor reads; the transient is over when it begins. */
void seed_001_record(recording_t *recording, double frequency_hz, double amplitude_v, double seconds, uint64_t seed);

#endif
