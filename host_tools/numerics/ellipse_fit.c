/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/ellipse_fit.h"
#include "numerics/gsl_errors.h"
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_math.h>
#include <string.h>

enum { LEAST_POINTS = 6, UNKNOWNS = 5 };

/* Thinner than this, of its length, a set of points is a line: the square of it is what the sums still resolve. */
static const double thinnest = 1e-6;

/* Points shifted and turned so that mean is 0 and both coordinates have RMS 1 and no correlation: the fit does not
 * care (it is affine-invariant), its arithmetic does. u = (x - x_mean) / x_rms,  v = (y - y_mean - slope (x - x_mean))
 * / v_rms. */
typedef struct {
    double x_mean, y_mean, x_rms, slope, v_rms;
} frame_t;

/* A u^2 + B u v + C v^2 + D u + E v + F = 0. */
typedef struct {
    double a, b, c, d, e, f;
} conic_t;

static bool make_frame(const double *x, const double *y, size_t count, frame_t *frame, failure_t *failure) {
    const double n = (double)count;
    double xx = 0.0, xy = 0.0, yy = 0.0;
    *frame = (frame_t){0};
    for (size_t i = 0; i < count; i++) {
        frame->x_mean += x[i] / n;
        frame->y_mean += y[i] / n;
    }
    for (size_t i = 0; i < count; i++) {
        const double dx = x[i] - frame->x_mean, dy = y[i] - frame->y_mean;
        xx += dx * dx / n;
        xy += dx * dy / n;
        yy += dy * dy / n;
    }
    if (!(xx > 0.0 && yy > 0.0 && yy - xy * xy / xx > gsl_pow_2(thinnest) * yy)) {
        return fail(failure, "the points lie on a straight line: no ellipse runs through them");
    }
    frame->x_rms = sqrt(xx);
    frame->slope = xy / xx;
    frame->v_rms = sqrt(yy - xy * xy / xx);
    return true;
}

/* Sums of products of (u^2, u v, v^2 | u, v, 1). */
static void add_up(const double *x, const double *y, size_t count, const frame_t *frame, double scatter[6][6]) {
    memset(scatter, 0, 36 * sizeof(double));
    for (size_t i = 0; i < count; i++) {
        const double dx = x[i] - frame->x_mean;
        const double u = dx / frame->x_rms, v = (y[i] - frame->y_mean - frame->slope * dx) / frame->v_rms;
        const double row[6] = {u * u, u * v, v * v, u, v, 1.0};
        for (size_t j = 0; j < 6; j++) {
            for (size_t k = 0; k < 6; k++) {
                scatter[j][k] += row[j] * row[k] / (double)count;
            }
        }
    }
}

/* The eigenvector of `reduced` with 4 A C > B^2; exactly one has it (Fitzgibbon, section 3.2). */
static bool elliptic_eigenvector(gsl_matrix *reduced, double quadratic[3]) {
    gsl_eigen_nonsymmv_workspace *space = gsl_eigen_nonsymmv_alloc(3);
    gsl_vector_complex *values = gsl_vector_complex_alloc(3);
    gsl_matrix_complex *vectors = gsl_matrix_complex_alloc(3, 3);
    double best = 0.0;
    gsl_eigen_nonsymmv(reduced, values, vectors, space);
    for (size_t k = 0; k < 3; k++) {
        double a[3];
        for (size_t i = 0; i < 3; i++) {
            a[i] = GSL_REAL(gsl_matrix_complex_get(vectors, i, k));
        }
        const double discriminant = 4.0 * a[0] * a[2] - a[1] * a[1];
        if (discriminant > best) {
            best = discriminant;
            memcpy(quadratic, a, sizeof a);
        }
    }
    gsl_matrix_complex_free(vectors);
    gsl_vector_complex_free(values);
    gsl_eigen_nonsymmv_free(space);
    return best > 0.0;
}

static bool fit_conic(const double scatter[6][6], conic_t *conic) {
    double s3[9], t[3][3], reduced[9], quadratic[3] = {0}, linear[3] = {0};
    gsl_matrix_view s3_view = gsl_matrix_view_array(s3, 3, 3), reduced_view = gsl_matrix_view_array(reduced, 3, 3);
    for (size_t i = 0; i < 9; i++) {
        s3[i] = scatter[3 + i / 3][3 + i % 3];
    }
    gsl_linalg_cholesky_decomp1(&s3_view.matrix); /* of the moments of u, v, 1: positive definite in this frame */
    for (size_t j = 0; j < 3; j++) {              /* t = -S3^-1 S2': the linear part that suits a quadratic part best */
        gsl_vector_view column = gsl_vector_view_array_with_stride(&t[0][j], 3, 3);
        for (size_t i = 0; i < 3; i++) {
            t[i][j] = -scatter[j][3 + i];
        }
        gsl_linalg_cholesky_svx(&s3_view.matrix, &column.vector);
    }
    double m[3][3];
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            m[i][j] = scatter[i][j];
            for (size_t k = 0; k < 3; k++) {
                m[i][j] += scatter[i][3 + k] * t[k][j];
            }
        }
    }
    for (size_t j = 0; j < 3; j++) { /* times the inverse of the constraint's matrix (0 0 2; 0 -1 0; 2 0 0) */
        reduced[j] = 0.5 * m[2][j];
        reduced[3 + j] = -m[1][j];
        reduced[6 + j] = 0.5 * m[0][j];
    }
    if (!elliptic_eigenvector(&reduced_view.matrix, quadratic)) {
        return false;
    }
    for (size_t i = 0; i < 3; i++) {
        for (size_t k = 0; k < 3; k++) {
            linear[i] += t[i][k] * quadratic[k];
        }
    }
    *conic = (conic_t){quadratic[0], quadratic[1], quadratic[2], linear[0], linear[1], linear[2]};
    return true;
}

/* Out of the frame, and from the polynomial to centre, radii and angle. */
static bool conic_to_ellipse(const conic_t *c, const frame_t *frame, ellipse_t *ellipse) {
    const double determinant = 4.0 * c->a * c->c - c->b * c->b;
    const double u = (c->b * c->e - 2.0 * c->c * c->d) / determinant;
    const double v = (c->b * c->d - 2.0 * c->a * c->e) / determinant;
    const double level = -(c->f + 0.5 * (c->d * u + c->e * v)); /* A du^2 + B du dv + C dv^2 = level */
    if (!(level / c->a > 0.0)) {
        return false;
    }
    /* The same form in (dx, dy), divided by level: p dx^2 + 2 q dx dy + r dy^2 = 1. */
    const double du = 1.0 / frame->x_rms, dv = 1.0 / frame->v_rms, dv_x = -frame->slope / frame->v_rms;
    const double p = (c->a * du * du + c->b * du * dv_x + c->c * dv_x * dv_x) / level;
    const double q = (0.5 * c->b * du * dv + c->c * dv_x * dv) / level;
    const double r = c->c * dv * dv / level;
    const double dx = frame->x_rms * u;
    const double mean = 0.5 * (p + r), spread = hypot(0.5 * (p - r), q);
    ellipse->x_center = frame->x_mean + dx;
    ellipse->y_center = frame->y_mean + frame->slope * dx + frame->v_rms * v;
    /* Eigenvalues mean -+ spread; the smaller through the product, which does not cancel. */
    ellipse->minor = 1.0 / sqrt(mean + spread);
    ellipse->major = sqrt((mean + spread) / (p * r - q * q));
    ellipse->angle = 0.5 * atan2(-2.0 * q, r - p);
    return true;
}

/* Residual f of ellipse_fit.h and its derivatives with respect to x_center, y_center, major, minor and angle. */
static double residual(const ellipse_t *ellipse, double x, double y, double gradient[UNKNOWNS]) {
    const double a = ellipse->major, b = ellipse->minor, c = cos(ellipse->angle), s = sin(ellipse->angle);
    const double dx = x - ellipse->x_center, dy = y - ellipse->y_center;
    const double along = (c * dx + s * dy) / a, across = (c * dy - s * dx) / b, half = 0.5 * a * b;
    const double excess = along * along + across * across - 1.0;
    gradient[0] = -2.0 * half * (along * c / a - across * s / b);
    gradient[1] = -2.0 * half * (along * s / a + across * c / b);
    gradient[2] = 0.5 * b * (excess - 2.0 * along * along);
    gradient[3] = 0.5 * a * (excess - 2.0 * across * across);
    gradient[4] = 2.0 * half * along * across * (b / a - a / b);
    return half * excess;
}

static bool standard_errors(const double *x, const double *y, size_t count, const ellipse_t *ellipse,
                            ellipse_t *sigma) {
    double normal[UNKNOWNS * UNKNOWNS] = {0}, middle[UNKNOWNS][UNKNOWNS] = {{0}}, error[UNKNOWNS];
    gsl_matrix_view view = gsl_matrix_view_array(normal, UNKNOWNS, UNKNOWNS);
    for (size_t i = 0; i < count; i++) {
        double gradient[UNKNOWNS];
        const double f = residual(ellipse, x[i], y[i], gradient);
        for (size_t j = 0; j < UNKNOWNS; j++) {
            for (size_t k = 0; k < UNKNOWNS; k++) {
                normal[UNKNOWNS * j + k] += gradient[j] * gradient[k];
                middle[j][k] += f * f * gradient[j] * gradient[k];
            }
        }
    }
    gsl_returns_errors();
    const bool good = gsl_linalg_cholesky_decomp1(&view.matrix) == GSL_SUCCESS &&
                      gsl_linalg_cholesky_invert(&view.matrix) == GSL_SUCCESS;
    for (size_t i = 0; good && i < UNKNOWNS; i++) {
        double variance = 0.0;
        for (size_t j = 0; j < UNKNOWNS; j++) {
            for (size_t k = 0; k < UNKNOWNS; k++) {
                variance += normal[UNKNOWNS * i + j] * middle[j][k] * normal[UNKNOWNS * k + i];
            }
        }
        error[i] = sqrt(fmax(0.0, variance) * (double)count / (double)(count - UNKNOWNS));
    }
    if (good) {
        *sigma = (ellipse_t){error[0], error[1], error[2], error[3], error[4]};
    }
    return good;
}

bool ellipse_fit(const double *x, const double *y, size_t count, ellipse_t *ellipse, ellipse_t *sigma,
                 failure_t *failure) {
    frame_t frame;
    double scatter[6][6];
    conic_t conic;
    if (count < LEAST_POINTS) {
        return fail(failure, "%zu points are too few for an ellipse, %d are needed", count, LEAST_POINTS);
    }
    if (!make_frame(x, y, count, &frame, failure)) {
        return false;
    }
    add_up(x, y, count, &frame, scatter);
    if (!fit_conic((const double(*)[6])scatter, &conic) || !conic_to_ellipse(&conic, &frame, ellipse) ||
        (sigma != NULL && !standard_errors(x, y, count, ellipse, sigma))) {
        return fail(failure, "no ellipse comes near the points");
    }
    return true;
}

ellipse_sines_t ellipse_sines(const ellipse_t *ellipse) {
    const double a = ellipse->major, b = ellipse->minor, c = cos(ellipse->angle), s = sin(ellipse->angle);
    return (ellipse_sines_t){.x_radius = hypot(a * c, b * s),
                             .y_radius = hypot(a * s, b * c),
                             /* x is ahead of theta by atan2(b s, a c), y is behind it by atan2(b c, a s) */
                             .lag = atan2(a * b, (a * a - b * b) * s * c)};
}

double ellipse_arc(const ellipse_t *ellipse, double x, double side) {
    const ellipse_sines_t sines = ellipse_sines(ellipse);
    const double along = (x - ellipse->x_center) / sines.x_radius;
    const double inside = sqrt(fmax(0.0, 1.0 - along * along));
    return ellipse->y_center + sines.y_radius * (along * cos(sines.lag) + side * inside * sin(sines.lag));
}

ellipse_t ellipse_of_sines(double x_center, double y_center, const ellipse_sines_t *sines) {
    /* The second moments of the points: their principal axes are the ellipse's, over the square root of 2. */
    const double xx = sines->x_radius * sines->x_radius, yy = sines->y_radius * sines->y_radius;
    const double product = sines->x_radius * sines->y_radius, xy = product * cos(sines->lag);
    const double major = sqrt(0.5 * (xx + yy) + hypot(0.5 * (xx - yy), xy));
    return (ellipse_t){.x_center = x_center,
                       .y_center = y_center,
                       .major = major,
                       .minor = product * sin(sines->lag) / major, /* equal areas */
                       .angle = 0.5 * atan2(2.0 * xy, xx - yy)};
}
