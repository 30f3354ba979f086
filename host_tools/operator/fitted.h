/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A universal operator that was fitted, what it is fitted to, and the equations that are kept from fit to fit. */
#ifndef OPERATOR_FITTED_H
#define OPERATOR_FITTED_H

#include "operator/group_evidence.h"
#include "operator/rows.h"

/** A fitted operator. */
typedef struct {
    operator_t operator;
    bool turns; /**< the drive turned between samples, as its turns say; otherwise it never went beyond them */
    state_space_t behind; /**< what its position passes through */
    bool offsets_behind;  /**< that lets no constant through: the recordings' offsets are added behind it */
    pink_t noise;
    size_t *group;
    group_evidence_t evidence; /**< of the whitened columns; evidence.variance: of the whitened noise, in um^2 */
    double middle_um;          /**< of its position, taken out before */
    double *position_um;       /**< what it was fitted to: used outliers are pulled in to the edge of the noise */
    size_t outliers;           /**< how many */
} hysteresis_t;

void hysteresis_free(hysteresis_t *hysteresis);

/** Equations along some paths, kept from fit to fit: along the same paths and samples another position changes little
 * of them. */
typedef struct {
    bool there, turns;
    double rho;
    size_t thin;
    kept_rows_t rows;
    double *gram; /**< of the rows; the operator without a law */
} hysteresis_base_t;

void hysteresis_base_close(hysteresis_base_t *base);

/* A search for the noise needs eleven or so, and where a law is found it is made again. With fewer, all are made anew:
 * 65 in place of 46 for a stack's recording, with as few as three and with as many as eight. */
enum { HYSTERESIS_BASES = 12 };
typedef struct {
    size_t made; /**< so far; the newest ones are there */
    hysteresis_base_t base[HYSTERESIS_BASES];
} hysteresis_bases_t;

void hysteresis_bases_close(hysteresis_bases_t *bases);

/** The noise needs states, too. */
enum { BEHIND_STATES = STATE_SPACE_MOST - PINK_SECTIONS };

/** What an operator is fitted to. */
typedef struct {
    const operator_path_t *paths;
    size_t count;
    const double *position_um;   /**< of all paths, one after the other */
    const unsigned char *use;    /**< not 0: of these samples */
    size_t thin;                 /**< every `thin`-th is fitted */
    const state_space_t *behind; /**< what its position passes through, of at most BEHIND_STATES; NULL: nothing */
} hysteresis_data_t;

#endif
