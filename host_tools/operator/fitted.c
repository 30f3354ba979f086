/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/fitted.h"
#include <stdlib.h>

void hysteresis_free(hysteresis_t *h) {
    operator_free(&h->operator);
    group_evidence_free(&h->evidence);
    free(h->group);
    free(h->position_um);
    h->group = NULL;
    h->position_um = NULL;
}

void hysteresis_base_close(hysteresis_base_t *base) {
    kept_rows_close(&base->rows);
    free(base->gram);
    *base = (hysteresis_base_t){0};
}

void hysteresis_bases_close(hysteresis_bases_t *bases) {
    for (size_t i = 0; i < HYSTERESIS_BASES; i++) {
        hysteresis_base_close(&bases->base[i]);
    }
    *bases = (hysteresis_bases_t){0};
}
