/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A diagnosis in a terminal: the sentences of diagnosis_text.h, one below the other. */
#ifndef DIAGNOSIS_PRINT_H
#define DIAGNOSIS_PRINT_H

#include "report/diagnosis_text.h"
#include <stdio.h>

/** At most two screens. */
void diagnosis_print(FILE *file, const answer_t *answer, const account_t *account, const recording_t *recordings,
                     size_t count);

#endif
