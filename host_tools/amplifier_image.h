/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The parameter image inside the amplifier: reading the one in force, and replacing it. */
#ifndef AMPLIFIER_IMAGE_H
#define AMPLIFIER_IMAGE_H

#include "device.h"
#include "hyst/parameters.h"

/** Reads the image in force. */
bool amplifier_image_read(device_t *device, hyst_parameters_t *parameters, failure_t *failure);

/**
 * Uploads and commits a valid image, then reads it back and compares every word. On failure the image that was in force
 * still is, and the line says whether the amplifier refused (which field, which element, why) or what else went wrong.
 */
bool amplifier_image_write(device_t *device, const hyst_parameters_t *parameters, failure_t *failure);

#endif
