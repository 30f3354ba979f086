/* SPDX-License-Identifier: MIT */
/* The runs of a play bank: shared by what moves them (prandtl_ishlinskii.c) and what carries them over to another model
 * (prandtl_ishlinskii_carry.c). Private to the library. */
#ifndef HYST_PRANDTL_ISHLINSKII_RUNS_H
#define HYST_PRANDTL_ISHLINSKII_RUNS_H

#include "hyst/prandtl_ishlinskii.h"

/* Common growth of all thresholds, known before the sample. threshold + growth <= HYST_Q31_MAX by kappa_limit. */
static inline hyst_q31_t hyst_pi_growth(const hyst_pi_t *model, hyst_q30_t rate) {
    /* beta |v|: Q20 * Q30 = Q50, <= 2^62; 19 bits down is Q31. */
    const uint32_t speed = rate < 0 ? 0U - (uint32_t)rate : (uint32_t)rate;
    if (speed > model->rate_limit) {
        return model->kappa_limit;
    }
    return (hyst_q31_t)(uint32_t)(((uint64_t)(uint32_t)model->beta * speed + (UINT32_C(1) << 18)) >> 19);
}

/* z_i of an operator of the run. Fits, so 32 bits with wrap-around lead there although the level may need 33. */
static inline hyst_q31_t hyst_pi_memory_in(const hyst_pi_t *model, const hyst_pi_run_t *run, uint32_t i) {
    return (hyst_q31_t)((uint32_t)run->level + (uint32_t)run->side * (uint32_t)model->threshold[i]);
}

/*
 * B = response at the drive `level`, if that carried all operators of the run: S_end level + side M_end and what the
 * operators outside give, M_j = w_1 a_1 + ... + w_j a_j. Does not depend on where the run begins. With T_i, the
 * position at which a drive that goes outward (+1, -1) begins to carry operator i of the run is B + (side + outward)
 * T_i. (docs/MODELS.md, section 2.1.) Where side is 0, B is the mean of both responses, and the level a memory: |B| <=
 * 2^61.
 */
static inline int64_t hyst_pi_base(const hyst_pi_run_t *run) {
    if (run->side == 0) {
        return (run->response[HYST_PI_DOWN] + run->response[HYST_PI_UP]) >> 1; /* 2 B */
    }
    return run->response[run->side > 0 ? HYST_PI_DOWN : HYST_PI_UP];
}

/* What searches compare with, once the run begins at operator `first`. Returns the base, which stays. */
static inline int64_t hyst_pi_begin_at(const hyst_pi_t *model, hyst_pi_run_t *run, uint32_t first) {
    const hyst_q31_t threshold = model->threshold[first];
    const hyst_q31_t memory = hyst_pi_memory_in(model, run, first);
    run->first = (uint8_t)first;
    run->corner[HYST_PI_DOWN] = hyst_subtract(memory, threshold);
    run->corner[HYST_PI_UP] = hyst_add(memory, threshold);
    const int64_t turn = model->turn[first]; /* 2 T, even: (side + outward) T is one of -2 T, -T, 0, T and 2 T */
    int64_t base;
    if (run->side > 0) {
        base = run->response[HYST_PI_DOWN];
        run->response[HYST_PI_UP] = base + turn;
    } else if (run->side < 0) {
        base = run->response[HYST_PI_UP];
        run->response[HYST_PI_DOWN] = base - turn;
    } else {
        base = hyst_pi_base(run);
        run->response[HYST_PI_DOWN] = base - (turn >> 1);
        run->response[HYST_PI_UP] = base + (turn >> 1);
    }
    return base;
}

/* Bisection over 2^levels operators: PROBE(half) for each half from 2^(levels - 1) down to 1. Written out, because a
 * loop costs as much as its probes. */
#define HYST_PI_PROBE_LEVELS(levels, PROBE)                                                                            \
    switch (levels) {                                                                                                  \
    default: /* 8: 256 operators */                                                                                    \
        PROBE(128);                                                                                                    \
        __attribute__((fallthrough));                                                                                  \
    case 7:                                                                                                            \
        PROBE(64);                                                                                                     \
        __attribute__((fallthrough));                                                                                  \
    case 6:                                                                                                            \
        PROBE(32);                                                                                                     \
        __attribute__((fallthrough));                                                                                  \
    case 5:                                                                                                            \
        PROBE(16);                                                                                                     \
        __attribute__((fallthrough));                                                                                  \
    case 4:                                                                                                            \
        PROBE(8);                                                                                                      \
        __attribute__((fallthrough));                                                                                  \
    case 3:                                                                                                            \
        PROBE(4);                                                                                                      \
        __attribute__((fallthrough));                                                                                  \
    case 2:                                                                                                            \
        PROBE(2);                                                                                                      \
        __attribute__((fallthrough));                                                                                  \
    case 1:                                                                                                            \
        PROBE(1);                                                                                                      \
        __attribute__((fallthrough));                                                                                  \
    case 0:                                                                                                            \
        break;                                                                                                         \
    }

/*
 * Bisection over the runs outside of the innermost one, `open` of them: from the outermost on none is carried up to
 * some one, and then all are (nesting). Shar's way (Knuth, The Art of Computer Programming 3, section 6.2.1):
 * FIRST(size) asks for the run at the largest power of two. If that is not carried, it goes on where the powers below
 * reach the innermost. PROBE(half) asks for each of these: floor(log2(open)) + 1 questions.
 */
#define HYST_PI_BISECT_RUNS(open, FIRST, PROBE)                                                                        \
    switch ((open) > 0 ? 32 - __builtin_clz(open) : 0) {                                                               \
    case 0:                                                                                                            \
        break;                                                                                                         \
    case 1:                                                                                                            \
        FIRST(1);                                                                                                      \
        break;                                                                                                         \
    case 2:                                                                                                            \
        FIRST(2);                                                                                                      \
        PROBE(1);                                                                                                      \
        break;                                                                                                         \
    case 3:                                                                                                            \
        FIRST(4);                                                                                                      \
        PROBE(2), PROBE(1);                                                                                            \
        break;                                                                                                         \
    case 4:                                                                                                            \
        FIRST(8);                                                                                                      \
        PROBE(4), PROBE(2), PROBE(1);                                                                                  \
        break;                                                                                                         \
    case 5:                                                                                                            \
        FIRST(16);                                                                                                     \
        PROBE(8), PROBE(4), PROBE(2), PROBE(1);                                                                        \
        break;                                                                                                         \
    case 6:                                                                                                            \
        FIRST(32);                                                                                                     \
        PROBE(16), PROBE(8), PROBE(4), PROBE(2), PROBE(1);                                                             \
        break;                                                                                                         \
    case 7:                                                                                                            \
        FIRST(64);                                                                                                     \
        PROBE(32), PROBE(16), PROBE(8), PROBE(4), PROBE(2), PROBE(1);                                                  \
        break;                                                                                                         \
    default: /* 255 runs at most */                                                                                    \
        FIRST(128);                                                                                                    \
        PROBE(64), PROBE(32), PROBE(16), PROBE(8), PROBE(4), PROBE(2), PROBE(1);                                       \
        break;                                                                                                         \
    }

/* Last operator whose threshold is within reach, if that of operator 0 is. */
static inline uint32_t hyst_pi_last_within(const hyst_pi_t *model, uint32_t reach) {
    const hyst_q31_t *at = model->threshold;
#define PROBE(half) at = (uint32_t)at[half] <= reach ? at + (half) : at
    HYST_PI_PROBE_LEVELS(model->levels, PROBE)
#undef PROBE
    return (uint32_t)(at - model->threshold);
}

#endif
