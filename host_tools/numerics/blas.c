/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/blas.h"
#include <stdlib.h>
#include <string.h>

/* Declared here, as cblas.h would bring all of BLAS. */
extern void openblas_set_num_threads(int threads);
extern int openblas_get_num_threads(void);
extern char *openblas_get_corename(void);

int blas_threads(int threads) {
    const int before = openblas_get_num_threads();
    openblas_set_num_threads(threads);
    return before;
}

const char *blas_better_than(const char *chosen, int avx2_and_fma) {
    return avx2_and_fma != 0 && strcmp(chosen, "Prescott") == 0 ? "Haswell" : NULL;
}

static int has_avx2_and_fma(void) {
#ifdef __x86_64__
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
    return 0;
#endif
}

const char *blas_better_code(void) {
    return getenv("OPENBLAS_CORETYPE") == NULL ? blas_better_than(openblas_get_corename(), has_avx2_and_fma()) : NULL;
}
