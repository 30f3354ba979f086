/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef PROOF_SIMULATE_H
#define PROOF_SIMULATE_H

#include "cases.h"

/** What the sensor reads at each sample, noise and converter included. To be freed by the caller. */
double *simulate(const case_t *item, size_t recording, const excitation_t *excitation);

/** Gives the effects the parameters that reach the wanted strengths, each alone, and writes down what was reached. */
void reach_strengths(case_t *item, const excitation_t *excitation);

#endif
