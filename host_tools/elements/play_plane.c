/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/play_plane.h"
#include <math.h>
#include <string.h>

size_t play_plane_divisions(size_t cells) {
    size_t n = 2;
    while (n <= PLAY_PLANE_MAX && play_plane_cells(n) < cells) {
        n++;
    }
    return n <= PLAY_PLANE_MAX && play_plane_cells(n) == cells ? n : 0;
}

void play_plane_open(play_plane_t *plane, size_t divisions, double alpha_s, double beta_s, double sample_rate_hz) {
    memset(plane, 0, sizeof *plane);
    plane->divisions = divisions;
    plane->fall = alpha_s * sample_rate_hz;
    plane->rise = beta_s * sample_rate_hz;
}

static double clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

void play_plane_settle(play_plane_t *plane, double u, double *cell) {
    memset(plane->play, 0, sizeof plane->play);
    plane->input = u;
    plane->rate = 0.0;
    play_plane_step(plane, u, cell);
}

void play_plane_step(play_plane_t *plane, double u, double *cell) {
    const size_t n = plane->divisions;
    const double low = u - plane->fall * fabs(plane->rate), high = u + plane->rise * fabs(plane->rate);
    for (size_t i = 1; i < n; i++) {
        const double r = (double)i / (double)n, half_width = (1.0 - r) / (double)(n - i);
        double *play = &plane->play[i - 1];
        *play = clamp(*play, low - r, high + r);
        for (size_t j = 0; j < n - i; j++) {
            const double center = (double)(2 * j + 1) * half_width - (1.0 - r);
            *cell++ = clamp((*play - center) / half_width, -1.0, 1.0);
        }
    }
    plane->rate = u - plane->input;
    plane->input = u;
}
