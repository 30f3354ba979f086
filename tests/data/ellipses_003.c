/* SPDX-License-Identifier: MIT */
#include "ellipses_003.h"
#include <math.h>

const ellipse_003_t ellipses_003[ELLIPSES_003] = {
    {0.5, 0.4983, 0.5725, 0.1129, 0.0066, 0.5881}, {1, 0.4980, 0.5720, 0.1132, 0.0061, 0.5800},
    {5, 0.4985, 0.5729, 0.1128, 0.0070, 0.5775},   {10, 0.4983, 0.5729, 0.1135, 0.0069, 0.5672},
    {20, 0.4982, 0.5722, 0.1136, 0.0080, 0.5610},  {50, 0.4984, 0.5728, 0.1146, 0.0112, 0.5516},
    {100, 0.4984, 0.5730, 0.1150, 0.0160, 0.5386}, {200, 0.4987, 0.5724, 0.1144, 0.0258, 0.5107},
    {300, 0.4990, 0.5720, 0.1117, 0.0355, 0.4912}};

void ellipse_003_point(const ellipse_003_t *ellipse, double theta, double *drive_v, double *displacement_um) {
    const double a = ellipse->major, b = ellipse->minor, phi = ellipse->angle;
    *drive_v = 150.0 * (ellipse->x_center + a * cos(phi) * cos(theta) - b * sin(phi) * sin(theta));
    *displacement_um = 90.0 * (ellipse->y_center + a * sin(phi) * cos(theta) + b * cos(phi) * sin(theta));
}
