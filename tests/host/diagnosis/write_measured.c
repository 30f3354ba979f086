/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writes recordings with measured columns for the test of the command. Usage: write_measured CASE FILE.csv */
#include "command_line/print.h"
#include "measured_actuator.h"
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    actuator_t actuator;
} cases[] = {
    {"nothing", {.climate = WANDERING_TEMPERATURE, .voltage = true, .current = true, .temperature = true}},
    {"amplifier_alone", {.amplifier_hz = 600.0}},
    {"amplifier_voltage", {.amplifier_hz = 600.0, .voltage = true}},
    {"amplifier_current", {.amplifier_hz = 600.0, .current = true}},
    {"sensor_voltage", {.sensor_hz = 600.0, .voltage = true}},
    {"delay_before", {.amplifier_delay_s = 0.75e-3, .voltage = true}},
    {"delay_behind", {.sensor_delay_s = 0.75e-3, .voltage = true}},
    {"low_passes", {.amplifier_hz = 300.0, .sensor_hz = 500.0, .voltage = true}},
    {"delay_and_sensor", {.amplifier_delay_s = 0.5e-3, .sensor_hz = 300.0, .voltage = true}},
    {"slew_current", {.slew_v_per_s = 3000.0, .current = true}},
    {"cycling", {.climate = CYCLING_TEMPERATURE, .um_per_kelvin = 0.05, .temperature = true}},
    {"warming", {.climate = WARMING_UP, .um_per_kelvin = 0.05, .temperature = true}},
    {"wandering", {.climate = WANDERING_TEMPERATURE, .um_per_kelvin = 0.05, .temperature = true}},
};

int main(int argc, char **argv) {
    for (size_t i = 0; argc == 3 && i < sizeof cases / sizeof cases[0]; i++) {
        if (strcmp(cases[i].name, argv[1]) == 0) {
            random_t rng = random_start("write_measured", 20261121);
            actuator_t actuator = cases[i].actuator;
            recording_t recording;
            failure_t failure;
            actuator.samples = 8000;
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
