/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The weights of the universal operator by least squares and evidence, at given turns, law and noise. */
#ifndef OPERATOR_EQUATIONS_H
#define OPERATOR_EQUATIONS_H

#include "operator/fitted.h"
#include "operator/law_rows.h"

/** What a fit is made of. */
typedef struct {
    const hysteresis_data_t *data;
    hysteresis_bases_t *bases;
    state_space_t behind;
    size_t longest, used; /**< samples: of the longest path; that are fitted */
    double *position_um;  /**< less its middle; outliers are pulled in */
} operator_question_t;

/** Replaces the weights and the evidence, which says where they begin. leaks: false: without the columns that are
 * nearly laws. Of every `thin`-th used sample. */
bool equations_fit(const operator_question_t *question, size_t thin, bool leaks, hysteresis_t *hysteresis,
                   failure_t *failure);

/** Where rows of the operator without a law are wanted, beside the turns of a fit. */
typedef struct {
    bool turns;
    double rho;
} base_place_t;

/** These are kept from now on, until others are prepared: those that were not are made side by side. At most
 * HYSTERESIS_BASES. */
void equations_prepare(const operator_question_t *question, const hysteresis_t *hysteresis, size_t thin,
                       const base_place_t *place, size_t count);
/** At these corners of the noise rows may be wanted soon: those that are not kept are made in one walk along the paths,
 * at a fraction of what each alone takes. Their products are made side by side, as nearly all are wanted. At most
 * ROWS_MOST_NOISES. */
void equations_foresee(const operator_question_t *question, const hysteresis_t *hysteresis, size_t thin,
                       const double *rho, size_t count);
/** Rows of the operator without a law, at the turns and the noise of a fit: those that are kept, or new ones in the
 * place of the oldest. Threads may ask at once for what was prepared. */
const hysteresis_base_t *equations_base(const operator_question_t *question, const hysteresis_t *hysteresis,
                                        size_t thin);
/** The rows of a fitted operator, which are the caller's from now on. false: they are not kept; with a law they never
 * are. */
bool equations_take_rows(hysteresis_bases_t *bases, const hysteresis_t *hysteresis, size_t thin, kept_rows_t *rows);
/** The position, whitened, in these rows; to be freed. */
double *equations_values(const operator_question_t *question, const hysteresis_t *hysteresis,
                         const hysteresis_base_t *base);
/** Where a law's columns are wanted: at these rows. */
law_along_t equations_along(const operator_question_t *question, const hysteresis_t *hysteresis,
                            const hysteresis_base_t *base);

#endif
