/* SPDX-License-Identifier: MIT */
/**
 * Fixed-point formats and the primitives that everything in lib/hyst is made of.
 *
 * A signal (drive, position, play memory) is a fraction of full scale in Q31: value = integer / 2^31, range [-1, 1).
 * Qn is a signed 32-bit integer worth integer / 2^n. The type says the format; a bare int32_t is a count or a code.
 *
 * Rounding is to nearest with halves toward plus infinity, everywhere. Nothing here wraps: a function either cannot
 * overflow for any argument (the bound is stated) or saturates.
 *
 * May be called from: interrupt, main loop, host. Reentrant, no state.
 */
#ifndef HYST_FIXED_H
#define HYST_FIXED_H

#include <stdint.h>

#if defined(__ARM_FEATURE_DSP)
#include <arm_acle.h>
#endif

typedef int32_t hyst_q31_t; /**< [-1, 1) in steps of 2^-31 */
typedef int32_t hyst_q30_t; /**< [-2, 2) in steps of 2^-30 */
typedef int32_t hyst_q28_t; /**< [-8, 8) in steps of 2^-28 */
typedef int32_t hyst_q20_t; /**< [-2048, 2048) in steps of 2^-20 */

#define HYST_Q31_MAX INT32_MAX
#define HYST_Q31_MIN INT32_MIN
#define HYST_Q30_ONE ((hyst_q30_t)1 << 30)
#define HYST_Q28_ONE ((hyst_q28_t)1 << 28)
#define HYST_Q20_ONE ((hyst_q20_t)1 << 20)

/** A function that is not copied into its callers: what it does is much, or rare, and there it would take the registers
 * of what each sample does. docs/TIMING.md. */
#define HYST_APART __attribute__((noinline))

/** A function that is copied into its callers whatever its size: one copy for each direction or kind that they name. */
#define HYST_WITHIN inline __attribute__((always_inline))

/* C11 leaves the right shift of a negative number to the compiler. The library needs the arithmetic one. */
_Static_assert((-3 >> 1) == -2, "lib/hyst needs an arithmetic right shift");

/** x if it fits into 32 bits, else the nearer end of the range. */
static inline int32_t hyst_saturate(int64_t x) {
    const int32_t near = (int32_t)(uint32_t)(uint64_t)x;
    if (near == x) {
        return near;
    }
    return x < 0 ? INT32_MIN : INT32_MAX;
}

/** a + b, saturated. One instruction on a Cortex-M4. */
static inline int32_t hyst_add(int32_t a, int32_t b) {
#if defined(__ARM_FEATURE_DSP)
    return __qadd(a, b);
#else
    return hyst_saturate((int64_t)a + b);
#endif
}

/** a - b, saturated. One instruction on a Cortex-M4. */
static inline int32_t hyst_subtract(int32_t a, int32_t b) {
#if defined(__ARM_FEATURE_DSP)
    return __qsub(a, b);
#else
    return hyst_saturate((int64_t)a - b);
#endif
}

/** a * b in full. |result| <= 2^62, so two of them may be added. */
static inline int64_t hyst_product(int32_t a, int32_t b) {
    return (int64_t)a * b;
}

/** x 2^28 in full: Q31 to Q59. Word by word, because the compiler makes four shifts of a product. */
static inline int64_t hyst_times_q28(int32_t x) {
    return (int64_t)((uint64_t)(uint32_t)(x >> 4) << 32 | (uint32_t)x << 28);
}

/** c + a b / 2^32, rounded to nearest. One instruction on a Cortex-M4. |c| + |a b| / 2^32 < 2^31. */
static inline int32_t hyst_add_high_product(int32_t c, int32_t a, int32_t b) {
#if defined(__ARM_FEATURE_DSP)
    int32_t result;
    __asm__("smmlar %0, %1, %2, %3" : "=r"(result) : "r"(a), "r"(b), "r"(c));
    return result;
#else
    return c + (int32_t)((hyst_product(a, b) + ((int64_t)1 << 31)) >> 32);
#endif
}

/** c - a b / 2^32, rounded likewise: c and the nearest to -a b / 2^32. */
static inline int32_t hyst_subtract_high_product(int32_t c, int32_t a, int32_t b) {
#if defined(__ARM_FEATURE_DSP)
    int32_t result;
    __asm__("smmlsr %0, %1, %2, %3" : "=r"(result) : "r"(a), "r"(b), "r"(c));
    return result;
#else
    return c + (int32_t)((((int64_t)1 << 31) - hyst_product(a, b)) >> 32);
#endif
}

/** x / 2^shift, rounded to nearest. 1 <= shift <= 62 and x <= INT64_MAX - 2^(shift-1). */
static inline int64_t hyst_round_shift(int64_t x, unsigned shift) {
    return (x + ((int64_t)1 << (shift - 1U))) >> shift;
}

/** |x|; x > INT64_MIN. */
static inline int64_t hyst_magnitude(int64_t x) {
    return x < 0 ? -x : x;
}

/** x limited to [low, high]; low <= high. */
static inline int32_t hyst_clamp(int32_t x, int32_t low, int32_t high) {
    if (x < low) {
        return low;
    }
    return x > high ? high : x;
}

#endif
