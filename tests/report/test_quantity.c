/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Numbers as one writes them by hand. */
#include "base/quantity.h"
#include <math.h>
#include <string.h>
#include <unity.h>

void setUp(void) {
}

void tearDown(void) {
}

static void expect(const char *expected, const char *name, const char *unit, double value, double sigma) {
    char text[QUANTITY_TEXT];
    quantity_text(text, name, unit, value, sigma);
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_as_many_digits_as_the_error_has(void) {
    expect("delay 266 +- 3 ms", "delay_s", "s", 0.26604, 0.0031);
    expect("delay 266 +- 3 us", "delay_s", "s", 0.000266, 0.0000031);
    expect("delay 2.66 +- 0.03 ms", "delay_s", "s", 0.002663, 0.0000312);
    expect("frequency 301.1 +- 0.3 Hz", "frequency_hz", "Hz", 301.06, 0.3);
    expect("frequency 301.06 +- 0.12 Hz", "frequency_hz", "Hz", 301.06, 0.1249);
    expect("damping ratio 0.0299 +- 0.0012", "damping_ratio", "1", 0.0299, 0.0012);
    expect("x 12.0 +- 1.0", "x", "1", 12.02, 0.98);
    expect("x 12.02 +- 0.09", "x", "1", 12.02, 0.094);
    expect("x 12350 +- 120", "x", "1", 12345.0, 123.0);
    expect("x 12300 +- 400", "x", "1", 12345.0, 432.0);
}

static void test_prefixes(void) {
    expect("step 12.5 +- 0.5 nm", "step_um", "um", 0.0125, 0.0005);
    expect("mode 2.400 +- 0.020 kHz", "mode_hz", "Hz", 2400.0, 20.0);
    expect("gain 0.27 um/V", "gain_um_per_v", "um/V", 0.27, (double)NAN); /* a quotient takes none */
    expect("gamma per decade -0.0076 +- 0.0004", "gamma_per_decade", "1", -0.0076, 0.0004);
    expect("delay 0 s", "delay_s", "s", 0.0, 0.0);
    expect("delay 0.0 +- 1.2 ms", "delay_s", "s", 0.0, 0.0012);
    expect("drift -120 +- 20 nm", "drift_um", "um", -0.12, 0.02);
}

static void test_what_was_counted_has_all_digits(void) {
    expect("samples 123456", "samples", "1", 123456.0, 0.0);
    expect("samples 123500", "samples", "1", 123456.0, HUGE_VAL); /* estimated */
    expect("gap 1.235 s", "gap_s", "s", 1.23456, 0.0);
    expect("samples 0", "samples", "1", -0.0, 0.0);
}

static void test_a_name_may_be_missing(void) {
    expect("301.1 +- 0.3 Hz", "", "Hz", 301.06, 0.3);
}

static void test_no_text_overflows(void) {
    char name[2 * QUANTITY_TEXT], text[QUANTITY_TEXT];
    memset(name, 'n', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    quantity_text(text, name, "um", 1.0, 0.1);
    TEST_ASSERT_LESS_THAN_UINT64(sizeof text, strlen(text));
    quantity_text(text, "x", "1", 1e300, 1e-300);
    TEST_ASSERT_LESS_THAN_UINT64(sizeof text, strlen(text));
    quantity_range(text, -1e300, 1e300, 1e-300);
    TEST_ASSERT_LESS_THAN_UINT64(sizeof text, strlen(text));
}

static void expect_rounded(const char *expected, const char *unit, double value, int digits) {
    char text[QUANTITY_TEXT];
    quantity_named(text, "", unit, value, digits);
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_no_exponent_where_hands_write_none(void) {
    expect_rounded("13 ms", "s", 0.01321, 2);
    expect_rounded("300 Hz", "Hz", 301.06, 2);
    expect_rounded("1200", "1", 1234.0, 2);
    expect_rounded("-1.2 nm", "um", -0.001234, 2);
    expect_rounded("1 mHz", "Hz", 0.0009996, 3);
    expect_rounded("0 V", "V", 0.0, 3);
}

static void expect_range(const char *expected, double from, double to, double resolution) {
    char text[QUANTITY_TEXT];
    quantity_range(text, from, to, resolution);
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_bounds_of_a_range(void) {
    expect_range("30 .. 70", 29.67, 70.33, 0.0);
    expect_range("6.22 .. 6.51", 6.2241, 6.5138, 0.0);
    expect_range("1.2 .. 400", 1.21, 402.0, 0.0); /* decades: the lower bound is not 0 */
    expect_range("0 .. 100", 0.04, 100.2, 1.0);
    expect_range("-20.3 .. 119.8", -20.312, 119.83, 0.14);
    expect_range("1000.14 .. 1000.26", 1000.141, 1000.258, 0.0);
    expect_range("0", 0.0, 0.0, 0.0);
    expect_range("5.1", 5.123, 5.123, 0.0);
}

static void test_a_range_of_nothing_is_one_number(void) {
    expect_range("120000", 120000.0, 120000.00012, 0.0);
    expect_range("1000", 1000.0, 1000.000001, 0.0);
    expect_range("5", 4.98, 5.02, 1.0);
    expect_range("1772755198.3 .. 1772755199.1", 1772755198.34, 1772755199.07, 0.146); /* seconds since 1970 */
}

static void expect_time(const char *expected, double time_s, double interval_s) {
    char text[QUANTITY_TEXT];
    quantity_time(text, time_s, interval_s);
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_a_time_tells_samples_apart(void) {
    expect_time("6.513", 6.5130001, 0.001);
    expect_time("1772755198.0013", 1772755198.00133, 0.0001);
    expect_time("1772755198", 1772755198.0, 0.001);
    expect_time("-0.0006", -0.0006, 0.0006);
    expect_time("43200", 43200.0, 600.0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_as_many_digits_as_the_error_has);
    RUN_TEST(test_prefixes);
    RUN_TEST(test_what_was_counted_has_all_digits);
    RUN_TEST(test_a_name_may_be_missing);
    RUN_TEST(test_no_text_overflows);
    RUN_TEST(test_no_exponent_where_hands_write_none);
    RUN_TEST(test_bounds_of_a_range);
    RUN_TEST(test_a_range_of_nothing_is_one_number);
    RUN_TEST(test_a_time_tells_samples_apart);
    return UNITY_END();
}
