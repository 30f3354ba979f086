/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Numbers as printf writes them, from their exact value. number = f 2^q with 53 bits of f, so number 10^d is f 5^d
 * 2^(q + d). For the numbers of recordings that is a product below 2^128 and a shift to the right. The digits shifted
 * out say how to round: to nearest, halves to even, as printf does. What lies outside of that is left to printf.
 */
#include "recording/table/decimal.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { LONGER = 17, SHORTER = 9 };

static const uint64_t power_of_ten[] = {UINT64_C(1),
                                        UINT64_C(10),
                                        UINT64_C(100),
                                        UINT64_C(1000),
                                        UINT64_C(10000),
                                        UINT64_C(100000),
                                        UINT64_C(1000000),
                                        UINT64_C(10000000),
                                        UINT64_C(100000000),
                                        UINT64_C(1000000000),
                                        UINT64_C(10000000000),
                                        UINT64_C(100000000000),
                                        UINT64_C(1000000000000),
                                        UINT64_C(10000000000000),
                                        UINT64_C(100000000000000),
                                        UINT64_C(1000000000000000),
                                        UINT64_C(10000000000000000),
                                        UINT64_C(100000000000000000),
                                        UINT64_C(1000000000000000000)};

#if defined(__SIZEOF_INT128__)
__extension__ typedef unsigned __int128 wide_t;

/* 5^20 has 47 bits: with 53 more below 2^128. */
static const uint64_t power_of_five[] = {UINT64_C(1),
                                         UINT64_C(5),
                                         UINT64_C(25),
                                         UINT64_C(125),
                                         UINT64_C(625),
                                         UINT64_C(3125),
                                         UINT64_C(15625),
                                         UINT64_C(78125),
                                         UINT64_C(390625),
                                         UINT64_C(1953125),
                                         UINT64_C(9765625),
                                         UINT64_C(48828125),
                                         UINT64_C(244140625),
                                         UINT64_C(1220703125),
                                         UINT64_C(6103515625),
                                         UINT64_C(30517578125),
                                         UINT64_C(152587890625),
                                         UINT64_C(762939453125),
                                         UINT64_C(3814697265625),
                                         UINT64_C(19073486328125),
                                         UINT64_C(95367431640625)};

/* number 10^decimals, rounded. number > 0, 0 <= decimals <= 20. False if it is 2^62 or more, or not a shift to the
 * right by 1..126. */
static bool scaled(double number, int decimals, uint64_t *result) {
    int exponent;
    wide_t product = (wide_t)(uint64_t)ldexp(frexp(number, &exponent), 53);
    const int shift = 53 - exponent - decimals;
    if (shift < 1 || shift > 126) {
        return false;
    }
    product *= power_of_five[decimals];
    const wide_t unit = (wide_t)1 << shift, rest = product & (unit - 1U), half = unit >> 1;
    const wide_t whole = product >> shift;
    if (whole >> 62 != 0) {
        return false;
    }
    *result = (uint64_t)whole + (rest > half || (rest == half && ((uint64_t)whole & 1U) != 0) ? 1U : 0U);
    return true;
}
#else
static bool scaled(double number, int decimals, uint64_t *result) {
    (void)number;
    (void)decimals;
    (void)result;
    return false;
}
#endif

/* `count` digits of a number, zeros in front included. */
static void put_digits(char *text, uint64_t number, int count) {
    while (count > 0) {
        text[--count] = (char)('0' + number % 10U);
        number /= 10U;
    }
}

/* digits 10^-decimals with `count` digits, zeros at the end left out. Where decimals >= count a zero stands before the
 * point. */
static size_t put_decimal(char *text, uint64_t digits, int count, int decimals) {
    size_t length = 0;
    while (decimals > 0 && digits % 10U == 0) {
        digits /= 10U;
        count--;
        decimals--;
    }
    const int before = count - decimals;
    if (before > 0) {
        char all[24];
        put_digits(all, digits, count);
        memcpy(text, all, (size_t)before);
        length = (size_t)before;
        if (decimals > 0) {
            text[length++] = '.';
            memcpy(text + length, all + before, (size_t)decimals);
            length += (size_t)decimals;
        }
        return length;
    }
    text[length++] = '0';
    text[length++] = '.';
    put_digits(text + length, digits, decimals);
    return length + (size_t)decimals;
}

static size_t by_printf(char *text, const char *format, int digits, double number) {
    char whole[DECIMAL_ROOM];
    const int length = digits > 0 ? snprintf(whole, sizeof whole, format, digits, number)
                                  : snprintf(whole, sizeof whole, format, number);
    memcpy(text, whole, (size_t)length);
    return (size_t)length;
}

/* Power of ten of the first digit, for 1e-4 <= number < 1e9: those that printf writes without exponent. */
static int first_digit(double number) {
    static const double ten[] = {1e-4, 1e-3, 1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8};
    int power = 12;
    while (number < ten[power]) {
        power--;
    }
    return power - 4;
}

static bool without_exponent(double size) {
    return size >= 1e-4 && size < 1e9;
}

size_t decimal_write(char *text, double number, int digits) {
    const double size = fabs(number);
    uint64_t value;
    if (!without_exponent(size)) {
        return by_printf(text, "%.*g", digits, number);
    }
    const int decimals = digits - 1 - first_digit(size);
    if (!scaled(size, decimals, &value)) {
        return by_printf(text, "%.*g", digits, number);
    }
    if (value >= power_of_ten[digits] || value < power_of_ten[digits - 1]) { /* next to a power of ten */
        return by_printf(text, "%.*g", digits, number);
    }
    size_t sign = 0;
    if (number < 0.0) {
        text[sign++] = '-';
    }
    return sign + put_decimal(text + sign, value, digits, decimals);
}

/*
 * Nine digits: the nearest integer to size 10^d, m < 10^9, reads back as m / 10^d, which is one rounding of exact
 * numbers (Clinger 1990). Where that is the number, the nine digits nearest to it are these: others are a millionfold
 * farther away.
 */
size_t decimal_write_exactly(char *text, double number) {
    const double size = fabs(number);
    if (number == 0.0) {
        const size_t sign = signbit(number) ? 1 : 0;
        text[0] = '-';
        text[sign] = '0';
        return sign + 1;
    }
    if (!without_exponent(size)) {
        const size_t length = decimal_write(text, number, SHORTER);
        double again;
        const char *end;
        text[length] = '\0';
        return decimal_read(text, '.', &again, &end) && again == number ? length : decimal_write(text, number, LONGER);
    }
    const int decimals = SHORTER - 1 - first_digit(size);
    const double ten = (double)power_of_ten[decimals], nearest = nearbyint(size * ten);
    if (nearest / ten != size || nearest >= 1e9 || nearest < 1e8) {
        return decimal_write(text, number, LONGER);
    }
    size_t sign = 0;
    if (number < 0.0) {
        text[sign++] = '-';
    }
    return sign + put_decimal(text + sign, (uint64_t)nearest, SHORTER, decimals);
}

size_t decimal_write_nano(char *text, double number) {
    uint64_t value;
    if (!(number >= 1e-4 && number < 1e9) || !scaled(number, 9, &value)) {
        return by_printf(text, "%.9f", 0, number);
    }
    const uint64_t seconds = value / UINT64_C(1000000000);
    int count = 1;
    while (count < 12 && seconds >= power_of_ten[count]) {
        count++;
    }
    put_digits(text, seconds, count);
    text[count] = '.';
    put_digits(text + count + 1, value % UINT64_C(1000000000), 9);
    return (size_t)count + 10;
}
