/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Position over drive: straight line, width of the loop, and what a curve adds to the line. */
#ifndef LOOK_STATIC_MAP_H
#define LOOK_STATIC_MAP_H

#include "look/signal/drive.h"

enum { STATIC_LEVELS = 25 };

typedef struct {
    double gain_um_per_v, offset_um; /**< least squares over all samples; offset at drive 0 */
    double stroke_um[2];             /**< range of the position */
    double line_error_percent;       /**< root mean square beside the line, of the stroke */
    double width_percent;            /**< largest distance of falling and rising branch, of the stroke; 0: unknown */
    bool lags;                       /**< the falling branch is the upper one (for a negative gain: the lower) */
    double bend_percent;             /**< height of a parabola over the range of the drive, of the stroke */
    size_t levels;                   /**< with samples on both branches */
    double level_v[STATIC_LEVELS], rising_um[STATIC_LEVELS], falling_um[STATIC_LEVELS]; /**< medians */
} static_map_t;

void static_map_look(const recording_t *recording, const drive_look_t *drive, static_map_t *map);

#endif
