/* SPDX-License-Identifier: MIT */
/**
 * Whether the reading of the position can be one: a sensor that is lost leaves its conditioner at an end of the range,
 * and a converter that is stuck repeats a code. Nothing is controlled by the position, so both are warnings; but what
 * is recorded, and the watch over the model, are worth nothing then.
 *
 * Debounce: the same code in SENSOR_WATCH_STILL samples in a row. Then the code of an end of the converter is a sensor
 * that is lost, and any code is a converter that is stuck if the drive has gone a quarter of its range meanwhile, forth
 * and back added up.
 */
#ifndef SENSOR_WATCH_H
#define SENSOR_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#define SENSOR_WATCH_STILL 1000U

/** Nothing seen. Before the sample interrupt runs. */
void sensor_watch_init(void);

/** Sample interrupt, each sample: the code as the board delivers it, and the magnitude of the drive's step. Returns
 * WARNING_ bits. Constant time. */
uint32_t sensor_watch_sample(uint16_t code, uint32_t step);

#endif
