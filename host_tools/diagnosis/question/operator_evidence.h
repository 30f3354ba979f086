/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What recordings say for themselves, before a diagnosis. */
#ifndef OPERATOR_EVIDENCE_H
#define OPERATOR_EVIDENCE_H

#include "recording/recording.h"
#include <stdbool.h>

/** Log evidence, in natural units, of the universal operator alone on these recordings: how likely a hysteresis of any
 * shape, with noise, makes their readings. For comparing readings that were set right with those as they are. false:
 * they are too few, or nothing moves. */
bool operator_evidence(const recording_t *recordings, size_t count, double *log_evidence);

#endif
