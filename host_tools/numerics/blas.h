/* SPDX-License-Identifier: GPL-3.0-or-later */
/** OpenBLAS' settings: threads, and for which processor its code is. */
#ifndef BLAS_H
#define BLAS_H

/** Its threads from now on; returns how many it had. One is best beside columns that are short: they would wait for
 * each other. */
int blas_threads(int threads);

/** OpenBLAS chooses its code when it is loaded, and takes its slowest for a processor that it does not know, as one
 * that is newer than itself. A diagnosis takes a third longer with it. Returns the name of code that this processor can
 * run and that is faster, or NULL: what was chosen is right, or the user has chosen (environment variable
 * OPENBLAS_CORETYPE). It becomes true by that variable in a process that begins again. */
const char *blas_better_code(void);

/** The same of `chosen` (what OpenBLAS calls its code) and a processor with or without AVX2 and FMA. */
const char *blas_better_than(const char *chosen, int avx2_and_fma);

#endif
