/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Numbers are written as printf writes them and read as strtod reads them, to the last digit. */
#include "random.h"
#include "recording/table/decimal.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Equal only if they are the same number, sign of zero and all. */
static uint64_t bits_of(double number) {
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

/* The shorter of 9 and 17 digits, as the library's functions have it. */
static void expect(double number) {
    char expected[DECIMAL_ROOM], text[DECIMAL_ROOM + 1];
    size_t length;
    for (int digits = 9; digits <= 17; digits += 8) {
        snprintf(expected, sizeof expected, "%.*g", digits, number);
        length = decimal_write(text, number, digits);
        text[length] = '\0';
        TEST_ASSERT_EQUAL_STRING(expected, text);
    }
    snprintf(expected, sizeof expected, "%.9g", number);
    if (strtod(expected, NULL) != number) {
        snprintf(expected, sizeof expected, "%.17g", number);
    }
    length = decimal_write_exactly(text, number);
    text[length] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, text);
    double again;
    const char *end;
    TEST_ASSERT_TRUE(decimal_read(text, '.', &again, &end) && *end == '\0');
    TEST_ASSERT_EQUAL_HEX64(bits_of(number), bits_of(again));

    snprintf(expected, sizeof expected, "%.9f", number);
    length = decimal_write_nano(text, number);
    text[length] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static double any_number(void) {
    static const double decimals[] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10};
    const uint64_t kind = random_bits(&rng) % 6U;
    double number;
    if (kind == 0) { /* any bits */
        const uint64_t bits = random_bits(&rng);
        memcpy(&number, &bits, sizeof number);
        return isfinite(number) ? number : 1.0;
    }
    if (kind == 1) { /* few binary digits: exact halves of the last digit are among them */
        number = ldexp((double)random_between(&rng, 1, 1 << 20), random_between(&rng, -45, 8));
    } else if (kind == 2) { /* few decimal digits */
        number = (double)random_between(&rng, 0, 1000000000) / decimals[random_bits(&rng) % 11U];
    } else if (kind == 3) { /* next to a power of ten */
        number = pow(10.0, (double)random_between(&rng, -7, 11));
        for (int i = random_between(&rng, -3, 3); i != 0; i += i > 0 ? -1 : 1) {
            number = nextafter(number, i > 0 ? HUGE_VAL : 0.0);
        }
    } else { /* of the size of a recording's */
        number = random_unit(&rng) * pow(10.0, (double)random_between(&rng, -6, 10));
    }
    return random_unit(&rng) < 0.5 ? -number : number;
}

static void test_as_printf_and_strtod(void) {
    for (int k = 0; k < 600000; k++) {
        expect(any_number());
    }
}

static void test_corners(void) {
    const double corner[] = {
        0.0,  -0.0,  1e-4,      9.99999999e-5, 0.00099999999949999, 999999999.5, 1e9,
        0.5,  0.1,   1.0 / 3.0, 123456789.5,   0.0001234567895,     5e-324,      1.7976931348623157e308,
        1e-9, 5e-10, 1.5e-9,    2.5e-9,        99999.9999999995,    1e22,        1e23};
    for (size_t i = 0; i < sizeof corner / sizeof corner[0]; i++) {
        expect(corner[i]);
        expect(-corner[i]);
    }
}

int main(void) {
    UNITY_BEGIN();
    rng = random_start("test_decimal", 20261123);
    RUN_TEST(test_as_printf_and_strtod);
    RUN_TEST(test_corners);
    return UNITY_END();
}
