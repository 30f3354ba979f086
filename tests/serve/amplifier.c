/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * amplifier: the simulated amplifier of tests/device for a test that is no C program. Prints its port. A number on its
 * standard input is where the position sensor stands from then on, in codes beside the truth. It ends when that does.
 */
#include "simulated_device.h"
#include <stdio.h>
#include <stdlib.h>

int main(void) {
    const char *const port = simulated_device_start(NULL);
    printf("port: %s\n", port);
    (void)fflush(stdout);
    char text[32];
    while (fgets(text, sizeof text, stdin) != NULL) {
        simulated_device_line()->position_offset = (int)strtol(text, NULL, 10);
    }
    simulated_device_stop();
    return 0;
}
