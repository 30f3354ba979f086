/* SPDX-License-Identifier: MIT */
/**
 * Writes a recording, rebuilt from published numbers, to stdout: the 1 Hz row of ellipses_003.h.
 *
 * The ellipse's own drive amplitude is 14.2 V, not 15 V, because a least-squares ellipse cuts the sharp tips of the
 * loop. It cannot show those tips, minor loops, noise or creep: the recording is smoother than any measurement.
 */
#include "ellipses_003.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define FREQUENCY_HZ   1
#define SAMPLE_RATE_HZ 500
#define PERIODS        6

int main(void) {
    const double two_pi = 2.0 * acos(-1.0);
    const ellipse_003_t *row = &ellipses_003[1];

    printf("# sample_rate_hz: %d\n"
           "# drive_unit: V\n"
           "# displacement_unit: um\n"
           "# actuator: piezoelectric stack of Gu and Zhu (2010), 150 V, 90 um\n"
           "# origin: rebuilt from the published ellipse parameters of the 1 Hz loop (table 1), not measured samples\n"
           "# generator: tests/data/rebuild_recording.c\n"
           "t,drive,displacement\n",
           SAMPLE_RATE_HZ);
    for (int k = 0; k < PERIODS * SAMPLE_RATE_HZ / FREQUENCY_HZ; k++) {
        const double t = (double)k / SAMPLE_RATE_HZ;
        double drive_v, displacement_um;
        ellipse_003_point(row, two_pi * FREQUENCY_HZ * t, &drive_v, &displacement_um);
        printf("%.3f,%.5f,%.5f\n", t, drive_v, displacement_um);
    }
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
