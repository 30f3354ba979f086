/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The universal operator fitted to recordings: how much of a position some rate-independent hysteresis explains, and
 * what none does.
 */
#ifndef OPERATOR_HYSTERESIS_H
#define OPERATOR_HYSTERESIS_H

#include "operator/group_evidence.h"
#include "operator/rows.h"

/** A fitted operator. */
typedef struct {
    operator_t operator;
    bool turns; /**< the drive turned between samples, as its turns say; otherwise it never went beyond them */
    pink_t noise;
    size_t *group;
    group_evidence_t evidence; /**< of the whitened columns; evidence.variance: of the whitened noise, in um^2 */
    double middle_um;          /**< taken out of the position before */
    double *position_um;       /**< what it was fitted to, outliers pulled in to the edge of the noise */
    size_t outliers;           /**< how many */
} hysteresis_t;

/** Equations along some paths, kept from fit to fit: along the same paths and samples another position changes little
 * of them. */
typedef struct {
    bool turns;
    double rho;
    size_t thin;
    kept_rows_t rows;
    double *gram; /**< of the rows; the operator without a law */
} hysteresis_base_t;

/* A search for the noise needs eleven or so, and where a law is found it is made again. With fewer, all are made anew:
 * 65 in place of 46 for a stack's recording, with as few as three and with as many as eight. */
enum { HYSTERESIS_BASES = 12 };
typedef struct {
    size_t made; /**< so far; the newest ones are there */
    hysteresis_base_t base[HYSTERESIS_BASES];
} hysteresis_bases_t;

void hysteresis_bases_close(hysteresis_bases_t *bases);

/**
 * Fits to the samples with use[k] != 0 of all paths, one after the other (position_um likewise): the columns' weights,
 * a Duhem law where that is worth its numbers, whether the drive turned between samples, and the noise. Single samples
 * far outside the noise count as on its edge. Of the used samples every `thin`-th is fitted. To be freed. bases: {0},
 * or of a fit along the same paths to the same samples; to be closed. like: a fit of nearly the same, whose turns and
 * law are kept and whose noise is improved, at a fraction of the time; NULL: all is sought.
 */
bool hysteresis_fit(const operator_path_t *paths, size_t count, const double *position_um, const unsigned char *use,
                    size_t thin, const hysteresis_t *like, hysteresis_bases_t *bases, hysteresis_t *hysteresis,
                    failure_t *failure);
void hysteresis_free(hysteresis_t *hysteresis);

/** The position by its weights along paths, which need not be those it was fitted to. */
void hysteresis_predict(const hysteresis_t *hysteresis, const operator_path_t *paths, size_t count,
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
 * column: as many values as there are samples in all paths, as they stand (not whitened). The amplitude of s_j in what
 * is column 0 is product[j] / product[j * columns + j], its standard error 1 / sqrt(product[j * columns + j]), and what
 * it is worth product[j]^2 / (2 product[j * columns + j]) natural units.
 */
void hysteresis_beyond(const hysteresis_rows_t *rows, size_t columns, const double *const *column, double *product);

#endif
