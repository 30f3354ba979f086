/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * amplifier [SAMPLES]: the simulated amplifier of tests/device for a test that is no C program. Prints its port. A
 * number on its standard input is where the position sensor stands from then on, in codes beside the truth; "disarms
 * N": it answers none of the next N requests to disarm; "map": whoever opens the line next finds a register map of the
 * future, and it says "map". It ends when that does. SAMPLES are those of its loop in a
 * millisecond: 10 are a loop at 10 kHz.
 */
#include "simulated_device.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv) {
    const char *const port = simulated_device_start(NULL);
    simulated_device_line()->samples_per_ms = argc > 1 ? (int)strtol(argv[1], NULL, 10) : 0;
    printf("port: %s\n", port);
    (void)fflush(stdout);
    char text[32];
    while (fgets(text, sizeof text, stdin) != NULL) {
        if (strncmp(text, "disarms ", 8) == 0) {
            simulated_device_line()->lost_disarms = (unsigned)strtoul(text + 8, NULL, 10);
        } else if (strcmp(text, "map\n") == 0) {
            simulated_device_fault(LINE_LIES, 1, 2); /* magic is good, abi is one more, in two readings */
            printf("map\n");
            (void)fflush(stdout);
        } else {
            simulated_device_line()->position_offset = (int)strtol(text, NULL, 10);
        }
    }
    simulated_device_stop();
    return 0;
}
