/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The universal operator fitted to recordings: how much of a position some rate-independent hysteresis explains, and
 * what none does.
 */
#ifndef OPERATOR_HYSTERESIS_H
#define OPERATOR_HYSTERESIS_H

#include "operator/fitted.h"

/**
 * Fits the columns' weights, a Duhem law where that is worth its numbers, whether the drive turned between samples, and
 * the noise. Single samples far outside the noise count as on its edge. To be freed. like: a fit of nearly the same,
 * whose turns and law are kept and whose noise is improved, at a fraction of the time; NULL: all is sought. bases: {0},
 * or of a fit of another position to the same samples along the same paths, behind the same filter; to be closed.
 */
bool hysteresis_fit(const hysteresis_data_t *data, const hysteresis_t *like, hysteresis_bases_t *bases,
                    hysteresis_t *hysteresis, failure_t *failure);
/** The weights alone, all else as `like` has it, from as many samples as a search takes: a fraction of the time again,
 * for a position that the next fit begins with. */
bool hysteresis_fit_roughly(const hysteresis_data_t *data, const hysteresis_t *like, hysteresis_bases_t *bases,
                            hysteresis_t *hysteresis, failure_t *failure);

/** Its own position by its weights along paths, which need not be those it was fitted to; with offsets_behind, without
 * offsets. */
void hysteresis_predict(const hysteresis_t *hysteresis, const operator_path_t *paths, size_t count,
                        double *position_um);

/** With offsets_behind: adds those to what has passed through all that is behind it. */
void hysteresis_add_offsets(const hysteresis_t *hysteresis, const operator_path_t *paths, size_t count,
                            double *position_um);

/**
 * What it leaves of a position, whitened: left. open, of samples with use[k] == 0 (the others: 0): variance of that by
 * what the used samples leave open of the weights, in parts of evidence.variance. Where it is large a sample is not
 * determined: what is left there says nothing.
 */
void hysteresis_left(const hysteresis_t *hysteresis, const operator_path_t *paths, size_t count,
                     const double *position_um, const unsigned char *use, double *left, double *open);

/** Whitened rows of the operator: every `thin`-th used sample. They do not change while the fit does not. */
typedef struct {
    const hysteresis_t *hysteresis;
    const operator_path_t *paths;
    size_t count;
    kept_rows_t kept;
} hysteresis_rows_t;

/** The samples that it was fitted to, with the same `use` and `thin`. To be closed; fit and paths must outlive it. */
void hysteresis_rows_open(hysteresis_rows_t *rows, const hysteresis_t *hysteresis, const operator_path_t *paths,
                          size_t count, const unsigned char *use, size_t thin);
void hysteresis_rows_close(hysteresis_rows_t *rows);

/**
 * Products of columns beyond what the operator imitates, over these rows:
 *
 *     product[i * columns + j] = s_i' C^-1 s_j,   C = variance (1 + X (precisions)^-1 X' / variance): weights
 * integrated out
 *
 * column: as many values as there are samples in all paths, as they stand (not whitened), behind everything. The
 * amplitude of s_j in what is column 0 is product[j] / product[j * columns + j], its standard error 1 / sqrt(product[j
 * * columns + j]), and what it is worth product[j]^2 / (2 product[j * columns + j]) natural units.
 */
void hysteresis_beyond(const hysteresis_rows_t *rows, size_t columns, const double *const *column, double *product);

#endif
