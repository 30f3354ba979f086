/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the drive did between the rows of a recording that an amplifier made, and when the position was read. */
#ifndef SAMPLING_NOTE_H
#define SAMPLING_NOTE_H

#include "amplifier/device/device.h"
#include "recording/recording.h"

/**
 * Into the header. Where every sample of the loop was captured, the drive is held from row to row:
 * drive_between_samples, and displacement_sampled_after_s from the register sampled_after. (Firmware without that
 * register: neither. A line that fails, fails in the next request.) Where every `decimation`-th was, the drive moves in
 * steps of the loop from row to row: drive_step_s. The position is then taken to be read at the end of a step, which on
 * the h405 it is but for 2 us.
 */
void sampling_note(device_t *device, int64_t decimation, recording_t *recording);

#endif
