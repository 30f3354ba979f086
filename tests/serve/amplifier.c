/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * amplifier: the simulated amplifier of tests/device for a test that is no C program. Prints its port, and ends when
 * its standard input does.
 */
#include "simulated_device.h"
#include <stdio.h>

int main(void) {
    const char *const port = simulated_device_start(NULL);
    printf("port: %s\n", port);
    (void)fflush(stdout);
    while (getchar() != EOF) {
    }
    simulated_device_stop();
    return 0;
}
