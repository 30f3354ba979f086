/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The parameter image inside the amplifier: reading the one in force, and replacing it. */
#ifndef AMPLIFIER_IMAGE_H
#define AMPLIFIER_IMAGE_H

#include "amplifier/device/device.h"
#include "hyst/parameters.h"

/** Reads the image in force. */
bool amplifier_image_read(device_t *device, hyst_parameters_t *parameters, failure_t *failure);

/**
 * Whether this is the default image of an amplifier without parameters. Its scales of 1 V and 1 um for half of a
 * converter's range are placeholders; nothing may be driven with them.
 */
bool amplifier_image_is_neutral(const hyst_parameters_t *parameters);

/** A line unless this image was compiled from the model of this id (compile.h); `name` is the model's. */
bool amplifier_image_is_of(const hyst_parameters_t *parameters, uint32_t model_id, const char *name,
                           failure_t *failure);

/**
 * Uploads and commits a valid image, then reads it back and compares every word. On failure the previous image stays in
 * force, and the line says whether the amplifier refused (field, element, reason) or communication failed.
 */
bool amplifier_image_write(device_t *device, const hyst_parameters_t *parameters, failure_t *failure);

/**
 * Stores the image in force and the limits that are set (docs/REGISTERS.md, What a start finds), for the next start.
 * The amplifier has to be off; waits until its output is at rest.
 */
bool amplifier_image_store(device_t *device, failure_t *failure);

#endif
