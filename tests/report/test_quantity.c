/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Numbers as one writes them by hand. */
#include "report/quantity.h"
#include <math.h>
#include <unity.h>

void setUp(void) {
}

void tearDown(void) {
}

static void expect(const char *expected, const char *name, const char *unit, double value, double sigma) {
    char text[DIAGNOSIS_LINE] = "";
    quantity_append(text, name, unit, value, sigma);
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_as_many_digits_as_the_error_has);
    RUN_TEST(test_prefixes);
    return UNITY_END();
}
