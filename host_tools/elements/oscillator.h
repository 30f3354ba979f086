/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * An oscillator of second order: y'' + 2 zeta omega y' + omega^2 y = omega^2 u, gain 1 at rest, exact for the
 * interpolated input (smooth_drive.h). A mode of the mechanics, and a low pass of second order.
 */
#ifndef OSCILLATOR_H
#define OSCILLATOR_H

#include "chain/smooth_drive.h"

/** State and functions of a block that is one. Its parameters: omega / (2 pi) in Hz; zeta, below 1. */
typedef struct {
    drive_window_t drive;
    double state[2]; /**< y and y' at the last sample, per sample */
    bool line;       /**< whatever the drive does: it is slow */
    double transition[2][2], input[2][3];
    bool held;            /**< the input is (stage_setup_t.held) */
    double hold[2][2][2]; /**< transitions while the last sample's input is there, and then this one's */
} oscillator_stage_t;

void oscillator_stage_open(void *memory, const parameter_t *parameter, const stage_setup_t *setup);
void oscillator_stage_settle(void *memory, signal_t *signal);
void oscillator_stage_step(void *memory, signal_t *signal);

/** Where the output reversed within the last step: by the cubic that has its values and rates at both ends. before: the
 * output and its rate at the sample before. Returns before[0] if it did not. */
double oscillator_stage_turn(const oscillator_stage_t *stage, const double before[2]);

#endif
