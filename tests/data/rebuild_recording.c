/* SPDX-License-Identifier: MIT */
/**
 * Writes a recording, rebuilt from published numbers, to stdout.
 *
 * G.-Y. Gu, L.-M. Zhu, "Modeling of rate-dependent hysteresis in piezoelectric actuators using a family of ellipses",
 * Sensors and Actuators A (2010), doi:10.1016/j.sna.2010.09.020, table 1: an ellipse was fitted to each measured loop
 * of a stack driven with 75 V
 * + 15 V sin(2 pi f t). Centre, radii and angle are printed for each f, of drive / 150 V and displacement / 90 um. This
 * is the row of 1 Hz.
 *
 *     x(theta) = x_c + a cos(phi) cos(theta) - b sin(phi) sin(theta)          drive
 *     y(theta) = y_c + a sin(phi) cos(theta) + b cos(phi) sin(theta)          displacement
 *
 * The drive was a sine of constant frequency, so theta runs evenly, and it runs forwards: the displacement lags. The
 * ellipse's own drive amplitude is 14.2 V, not 15 V, because a least-squares ellipse cuts the sharp tips of the loop.
 * It cannot show those tips, minor loops, noise or creep: the recording is smoother than any measurement.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define FREQUENCY_HZ   1
#define SAMPLE_RATE_HZ 500
#define PERIODS        6

int main(void) {
    const double two_pi = 2.0 * acos(-1.0);
    const double drive_scale_v = 150.0, displacement_scale_um = 90.0;
    const double x_c = 0.4980, y_c = 0.5720, a = 0.1132, b = 0.0061, phi = 0.5800;

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
        const double theta = two_pi * FREQUENCY_HZ * t;
        const double x = x_c + a * cos(phi) * cos(theta) - b * sin(phi) * sin(theta);
        const double y = y_c + a * sin(phi) * cos(theta) + b * cos(phi) * sin(theta);
        printf("%.3f,%.5f,%.5f\n", t, drive_scale_v * x, displacement_scale_um * y);
    }
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
