/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The type of an open amplifier, for what device.h itself stands on. */
#ifndef DEVICE_TYPE_H
#define DEVICE_TYPE_H

typedef struct device device_t;

#endif
