/* SPDX-License-Identifier: GPL-3.0-or-later */
/** When the amplifier samples the position against the drive in the same row, for the header of what it recorded. */
#ifndef SAMPLING_NOTE_H
#define SAMPLING_NOTE_H

#include "amplifier/device.h"
#include "recording/recording.h"

/**
 * Writes displacement_sampled_after_s into the header, and drive_between_samples where every sample of the loop was
 * captured: the drive is then held from row to row. With every `decimation`-th sample it moves between two rows in
 * steps of the loop, which is the same drive half a sample of the loop later. A reference is what the position in its
 * own row should be: reference_sampled_with says so.
 *
 * Nothing for firmware without the register sampled_after. A line that fails, fails in the next request.
 */
void sampling_note(device_t *device, int64_t decimation, recording_t *recording);

#endif
