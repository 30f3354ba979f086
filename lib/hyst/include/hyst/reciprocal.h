/* SPDX-License-Identifier: MIT */
/**
 * Division of 64 by 32 bits by a divisor that is known beforehand: two products and two corrections, exact.
 *
 * Source: N. Moeller and T. Granlund, "Improved division by invariant integers", IEEE Transactions on Computers 60
 * (2011), algorithm 4 (2-by-1 division) and its theorem 2. With the divisor shifted up to d = divisor 2^s >= 2^31, the
 * reciprocal is v = floor((2^64 - 1) / d) - 2^32; the quotient's estimate from v is one too large or too small at most.
 * The same integers as the compiler's `/` and `%` (tests/unit/test_reciprocal.c), in a sixth of the instructions that
 * the Cortex-M4 takes for these.
 *
 * May be called from: interrupt, main loop, host (hyst_reciprocal divides: not per sample). Reentrant, no state.
 */
#ifndef HYST_RECIPROCAL_H
#define HYST_RECIPROCAL_H

#include <stdint.h>

/** v of a divisor > 0. */
static inline uint32_t hyst_reciprocal(uint32_t divisor) {
    const uint32_t normal = divisor << (unsigned)__builtin_clz(divisor);
    return (uint32_t)(UINT64_MAX / normal - ((uint64_t)1 << 32)); /* 2^32 <= the quotient < 2^33 */
}

/** dividend / divisor, rounded down; dividend < divisor 2^32. *remainder is dividend % divisor. */
static inline uint32_t hyst_divide(uint64_t dividend, uint32_t divisor, uint32_t reciprocal, uint32_t *remainder) {
    const unsigned shift = (unsigned)__builtin_clz(divisor); /* 0..31 */
    const uint32_t normal = divisor << shift;
    /* The shifted dividend is below normal * 2^32, so it fits. A product with 2^shift shifts 64 bits in two
     * instructions. */
    uint32_t power = UINT32_C(1) << shift;
    __asm__("" : "+r"(power)); /* or the compiler makes a shift of it again */
    const uint64_t lower = (uint64_t)(uint32_t)dividend * power;
    const uint32_t u1 = (uint32_t)(dividend >> 32) * power + (uint32_t)(lower >> 32);
    const uint32_t u0 = (uint32_t)lower;
    /* (2^32 + v) u1 + u0 <= (2^64 - 1) / normal * (normal - 1) + 2^32 - 1 < 2^64. */
    const uint64_t estimate = (uint64_t)reciprocal * u1 + ((uint64_t)u1 << 32 | u0);
    uint32_t quotient = (uint32_t)(estimate >> 32) + 1U;
    uint32_t rest = u0 - quotient * normal; /* modulo 2^32 */
    if (rest > (uint32_t)estimate) {
        quotient--;
        rest += normal;
    }
    if (rest >= normal) { /* rarely */
        quotient++;
        rest -= normal;
    }
    *remainder = rest >> shift;
    return quotient;
}

/**
 * dividend / divisor, rounded down, or 2^32 if it is that or more; divisor > 0. For a divisor that is not known
 * beforehand: two digits of 16 bits, each from one division of 32 bits and corrected twice at most (Knuth, The Art of
 * Computer Programming 2, 4.3.1, algorithm D and theorem B).
 */
static inline uint64_t hyst_divide_once(uint64_t dividend, uint32_t divisor) {
    if (dividend >> 32 >= divisor) {
        return UINT64_C(1) << 32;
    }
    const unsigned shift = (unsigned)__builtin_clz(divisor); /* 0..31 */
    const uint32_t normal = divisor << shift;
    const uint64_t shifted = dividend << shift; /* below normal * 2^32: fits */
    const uint32_t upper = normal >> 16;        /* 2^15 .. 2^16 - 1 */
    const uint32_t lower = normal & 0xFFFFU;
    uint32_t rest = (uint32_t)(shifted >> 32); /* < normal */
    uint32_t quotient = 0;
    for (unsigned k = 0; k < 2; k++) {
        const uint32_t next = (uint32_t)(shifted >> (16U - 16U * k)) & 0xFFFFU;
        uint32_t digit = rest / upper;
        uint32_t over = rest - digit * upper; /* < 2^16 */
        /* digit <= 2^16 + 1, so the products are below 2^33: in 64 bits, and twice at most. */
        while (digit > 0xFFFFU || (uint64_t)digit * lower > ((uint64_t)over << 16 | next)) {
            digit--;
            over += upper;
            if (over > 0xFFFFU) {
                break;
            }
        }
        rest = (rest << 16 | next) - digit * normal; /* modulo 2^32: 0 .. normal - 1 */
        quotient = quotient << 16 | digit;
    }
    return quotient;
}

/**
 * floor(2^33 rest / whole), 33 bits; rest < whole < 2^62. Three digits of 11 bits, each from one division of 32 bits.
 *
 * A digit's estimate is that of the upper 21 bits: R = rest, W = whole, shifted so that W begins with a one, less 43
 * bits each. Of r = floor(R) and w = floor(W) + 1 the estimate 2^11 r / w is below the digit 2^11 R / W by at most 2^11
 * (R + W) / (W (W + 1)) <= 2^12 / 2^20 before rounding down. So it is one too small at most, never too large.
 * tests/unit/ test_reciprocal.c.
 */
static inline uint64_t hyst_fraction(uint64_t rest, uint64_t whole) {
    const unsigned shift = (unsigned)__builtin_clzll(whole);
    const uint32_t w = (uint32_t)((whole << shift) >> 43) + 1U; /* 2^20 < w <= 2^21 */
    uint64_t bits = 0;
    for (unsigned k = 0; k < 3; k++) {
        const uint32_t r = (uint32_t)((rest << shift) >> 43); /* < 2^21 */
        uint32_t digit = (r << 11) / w;                       /* < 2^11 */
        rest = (rest << 11) - digit * whole;                  /* modulo 2^64: 0 .. 2 whole - 1, below 2^63 */
        if (rest >= whole) {
            rest -= whole;
            digit++;
        }
        bits = bits << 11 | digit;
    }
    return bits;
}

#endif
