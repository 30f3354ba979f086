/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writes recordings with measured columns for the test of the command. Usage: write_measured CASE FILE.csv */
#include "measured_actuator.h"
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    actuator_t actuator;
} cases[] = {
    {"null", {.climate = WANDERING_TEMPERATURE, .voltage = true, .current = true, .temperature = true}},
    {"amplifier", {.amplifier_hz = 150.0, .voltage = true}},
    {"amplifier_alone", {.amplifier_hz = 150.0}},
    {"sensor", {.sensor_hz = 150.0, .voltage = true}},
    {"sensor_alone", {.sensor_hz = 150.0}},
    {"delay_before", {.amplifier_delay_s = 0.75e-3, .voltage = true}},
    {"delay_behind", {.sensor_delay_s = 0.75e-3, .voltage = true}},
    {"slew", {.slew_v_per_s = 3000.0, .voltage = true, .current = true}},
    {"slew_current", {.slew_v_per_s = 3000.0, .current = true}},
    {"rail", {.rail_v = 92.0, .voltage = true}},
    {"ripple", {.ripple_v = 0.4, .voltage = true}},
    {"cycle", {.climate = CYCLING_TEMPERATURE, .um_per_kelvin = 0.05, .temperature = true}},
    {"cycle_lag", {.climate = CYCLING_TEMPERATURE, .um_per_kelvin = 0.3, .actuator_warms_s = 0.2, .temperature = true}},
    {"warming", {.climate = WARMING_UP, .um_per_kelvin = 0.05, .temperature = true}},
    {"walk", {.climate = WANDERING_TEMPERATURE, .um_per_kelvin = 0.05, .temperature = true}},
    {"walk_drift", {.climate = WANDERING_TEMPERATURE, .drift_um = 0.1, .temperature = true}},
    {"warming_drift", {.climate = WARMING_UP, .drift_um = 0.1, .temperature = true}},
    {"monitor", {.sensor_hz = 150.0, .monitor_hz = 1500.0, .monitor_gain = 0.05, .voltage = true}},
};

int main(int argc, char **argv) {
    for (size_t i = 0; argc == 3 && i < sizeof cases / sizeof cases[0]; i++) {
        if (strcmp(cases[i].name, argv[1]) == 0) {
            random_t rng = random_start("write_measured", 20261121 + i);
            actuator_t actuator = cases[i].actuator;
            recording_t recording;
            failure_t failure;
            actuator.samples = 12000;
            actuator.noise_um = 0.005;
            measure_actuator(&actuator, argv[2], &rng, &recording);
            const bool good = recording_write(&recording, argv[2], &failure);
            recording_free(&recording);
            return good ? 0 : failure_print(&failure);
        }
    }
    fprintf(stderr, "usage: write_measured CASE FILE.csv\n");
    return 2;
}
