/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Ellipses: direct least-squares fit to points of a plane, and the two sines that an ellipse stands for.
 *
 *     x(theta) = x_center + major cos(angle) cos(theta) - minor sin(angle) sin(theta)
 *     y(theta) = y_center + major sin(angle) cos(theta) + minor cos(angle) sin(theta)
 *
 * Source of the fit: Fitzgibbon, Pilu, Fisher, "Direct least square fitting of ellipses", IEEE PAMI 21 (1999) 476, in
 * the numerically stable form of Halir and Flusser (1998). It minimises the sum of squares of the quadratic polynomial
 * A x^2 + B x y + C y^2 + ... under 4 A C - B^2 = 1. No starting value, always an ellipse, and invariant under affine
 * maps of the plane. Source of the use: Gu and Zhu (docs/MODELS.md, section 13).
 */
#ifndef ELLIPSE_FIT_H
#define ELLIPSE_FIT_H

#include "base/failure.h"

typedef struct {
    double x_center, y_center;
    double major, minor; /**< radii, major >= minor > 0 */
    double angle;        /**< of the major axis against the x axis, rad, in (-pi/2, pi/2] */
} ellipse_t;

/**
 * Fits an ellipse to `count` points, 6 or more. *sigma (may be NULL) receives standard errors.
 *
 * The polynomial under its constraint is f = (major minor / 2) ((X / major)^2 + (Y / minor)^2 - 1) with X, Y along the
 * axes. The fit is therefore an ordinary least-squares problem in the five numbers of ellipse_t. The errors are those
 * of its linearisation, with each point's squared residual in the middle (the sandwich estimator, which allows noise
 * that differs from point to point). They assume that the noise is independent from point to point. Where the points do
 * not lie on an ellipse, as on a loop with sharp tips, that deviation counts as noise.
 *
 * Refuses points without extent in two directions: a straight line.
 */
bool ellipse_fit(const double *x, const double *y, size_t count, ellipse_t *ellipse, ellipse_t *sigma,
                 failure_t *failure);

/**
 * The two sines that draw the ellipse: x = x_center + x_radius sin(wt + lead), y = y_center + y_radius sin(wt + lead -
 * lag). Paper 003's r_v, r_y and alpha_1 - alpha_2.
 */
typedef struct {
    double x_radius, y_radius;
    double lag; /**< rad, in (0, pi): the loop turns counterclockwise, y falls behind x */
} ellipse_sines_t;

ellipse_sines_t ellipse_sines(const ellipse_t *ellipse);

/** y of the ellipse at x on its lower (side -1) or upper (side 1) arc: the rising and the falling branch of a
 * counterclockwise loop. Beyond the ends of the ellipse it follows the straight line through them. */
double ellipse_arc(const ellipse_t *ellipse, double x, double side);

/** The ellipse that two sines draw: the inverse of ellipse_sines. */
ellipse_t ellipse_of_sines(double x_center, double y_center, const ellipse_sines_t *sines);

#endif
