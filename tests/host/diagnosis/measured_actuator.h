/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A piezo actuator with instruments about it, for tests: drive, position, and beside them the voltage and the current
 * at the actuator and a thermometer. It shares no formula with the blocks: 8 steps a sample, the trapezoidal rule,
 * 60 play operators. Wherever a lag or a delay acts, the voltage is measured between amplifier and actuator.
 */
#ifndef MEASURED_ACTUATOR_H
#define MEASURED_ACTUATOR_H

#include "random.h"
#include "recording/recording.h"

typedef enum {
    CONSTANT_TEMPERATURE,
    CYCLING_TEMPERATURE,  /**< up and down every 0.43 s, by 0.5 K */
    WARMING_UP,           /**< exponentially, by 1 K with 4 s */
    WANDERING_TEMPERATURE /**< a random walk, 0.02 K a sample */
} climate_t;

/** 0: no such effect. */
typedef struct {
    size_t samples;                         /**< 6000 or more */
    double amplifier_hz, amplifier_delay_s; /**< before the voltage */
    double slew_v_per_s, rail_v;            /**< likewise */
    double ripple_v;                        /**< a disturbance of the voltage that no block knows */
    double sensor_hz, sensor_delay_s;       /**< behind the actuator */
    climate_t climate;
    double um_per_kelvin, actuator_warms_s; /**< time constant of a lag behind the thermometer */
    double drift_um;                        /**< something else that decays with 1.5 s */
    double monitor_gain;                    /**< of the voltage's measurement; 0: 1 */
    double monitor_hz;                      /**< low pass of that measurement */
    double noise_um;
    bool voltage, current, temperature; /**< which columns it has */
} actuator_t;

/** Creates the recording, at 2 kHz: the whole range, loops, steps with rests, a chirp from 5 to 200 Hz. */
void measure_actuator(const actuator_t *actuator, const char *name, random_t *rng, recording_t *recording);

#endif
