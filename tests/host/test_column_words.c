/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Words of names in any alphabet, the scales that names state, and signs between thousands. */
#include "recording/table/column_words.h"
#include "recording/table/decimal.h"
#include "recording/table/text_signs.h"
#include "recording/table/units.h"
#include "unity.h"
#include <string.h>

void setUp(void) {
}
void tearDown(void) {
}

static unsigned meaning_of(const char *name) {
    return column_words_read(name, name + strlen(name)).stands_for & ~(unsigned)WORD_NOTHING;
}

static bool is_strange(const char *name) {
    return column_words_read(name, name + strlen(name)).strange;
}

static void test_words_are_put_together(void) {
    TEST_ASSERT_EQUAL_UINT(WORD_VOLTS | WORD_COMMAND, meaning_of("Vin"));
    TEST_ASSERT_EQUAL_UINT(WORD_LENGTH | WORD_TARGET, meaning_of("Sollposition"));
    TEST_ASSERT_EQUAL_UINT(WORD_VOLTS, meaning_of("Messverst\xC3\xA4rkerspannung") & (unsigned)WORD_QUANTITIES);
    TEST_ASSERT_EQUAL_UINT(WORD_VOLTS | WORD_COMMAND, meaning_of("印加電圧"));
    TEST_ASSERT_EQUAL_UINT(WORD_LENGTH | WORD_COMMAND | WORD_AXIS, meaning_of("X軸指令位置"));
    TEST_ASSERT_EQUAL_UINT(WORD_LENGTH, meaning_of("压电位移1"));
}

static void test_accents_and_capitals_do_not_matter(void) {
    TEST_ASSERT_EQUAL_UINT(WORD_VOLTS, meaning_of("НАПРЯЖЕНИЕ"));
    TEST_ASSERT_EQUAL_UINT(WORD_VOLTS, meaning_of("napięcie"));
    TEST_ASSERT_EQUAL_UINT(WORD_LENGTH, meaning_of("Länge"));
    TEST_ASSERT_EQUAL_UINT(WORD_TIME | WORD_FIRST, meaning_of("Ｔｉｍｅ"));
}

static void test_an_unknown_word_is_strange(void) {
    TEST_ASSERT_TRUE(is_strange("siirtyma"));
    TEST_ASSERT_TRUE(is_strange("Position siirtyma"));
    TEST_ASSERT_TRUE(is_strange("宽"));
    TEST_ASSERT_FALSE(is_strange("CH1"));
    TEST_ASSERT_FALSE(is_strange("column 2"));
    TEST_ASSERT_FALSE(is_strange("a b"));
    TEST_ASSERT_FALSE(is_strange("Δ°µ")); /* signs */
}

static void test_letters_beyond_ascii_of_known_words(void) {
    const char *const name = "Zeit Länge siirtymä";
    TEST_ASSERT_EQUAL_UINT64(1, column_words_read(name, name + strlen(name)).foreign);
}

/* Neither ends within a letter nor goes on behind the end. */
static void test_cut_letters(void) {
    const char name[] = "\xE4\xBD\x8D\xE7\xA7\xBB";
    for (size_t length = 0; length < 6; length++) {
        TEST_ASSERT_EQUAL_UINT(0, column_words_read(name, name + length).stands_for);
    }
    TEST_ASSERT_EQUAL_UINT(WORD_LENGTH, column_words_read(name, name + 6).stands_for);
}

static void test_scales_in_names(void) {
    static const char *const scaled[] = {"HV monitor (1:100)", "Vin x20", "Vin 20x", "Vin (x5.0) x10",
                                         "Vin x20 of 3",       "Vin *5",  "Vin ×5"};
    static const char *const plain[] = {"x1",   "X10",    "Position x1", "CH1",   "10:11:12", "ai0:3",
                                        "V 20", "Vin 1:", "Vin 20",      "Vin x", ""};
    for (size_t i = 0; i < sizeof scaled / sizeof scaled[0]; i++) {
        TEST_ASSERT_TRUE_MESSAGE(unit_states_scale(scaled[i], false), scaled[i]);
    }
    for (size_t i = 0; i < sizeof plain / sizeof plain[0]; i++) {
        TEST_ASSERT_FALSE_MESSAGE(unit_states_scale(plain[i], false), plain[i]);
    }
    TEST_ASSERT_TRUE(unit_states_scale("Drive/20", true));
    TEST_ASSERT_FALSE(unit_states_scale("Drive/20", false));
    TEST_ASSERT_FALSE(unit_states_scale("Drive/1", true));
    TEST_ASSERT_FALSE(unit_states_scale("Model/Out1", true));
}

static void test_units_before_remarks(void) {
    char name[UNIT_FIELD] = "Position/nm (axis 1)", unit[UNIT_FIELD];
    unit_split(name, unit, "/_ ,");
    TEST_ASSERT_EQUAL_STRING("Position (axis 1)", name);
    TEST_ASSERT_EQUAL_STRING("nm", unit);
    strcpy(name, "Position (10 V = 20 um)");
    unit_split(name, unit, "/_ ,");
    TEST_ASSERT_EQUAL_STRING("Position", name);
    TEST_ASSERT_EQUAL_STRING("10 V = 20 um", unit);
    strcpy(name, "u_h"); /* no hours */
    unit_split(name, unit, "/_ ,");
    TEST_ASSERT_EQUAL_STRING("", unit);
}

static bool are_thousands(const char *const *field, size_t count) {
    text_groups_t groups = {0};
    for (size_t i = 0; i < count; i++) {
        (void)text_groups_count(&groups, field[i], strlen(field[i]));
    }
    return text_groups_are_thousands(&groups);
}

static void test_thousands_that_look_like_decimals(void) {
    static const char *const whole[] = {"987", "1,080", "-1,200", "12,345", "0"};
    static const char *const decimals[] = {"987", "1,080", "1,2", "12,345", "12,5"};
    static const char *const small[] = {"987", "0,080", "1,200", "12,345", "1,001"};
    static const char *const even[] = {"1,080", "1,200", "12,345", "9,870", "9,871"};
    TEST_ASSERT_TRUE(are_thousands(whole, 5));
    TEST_ASSERT_FALSE(are_thousands(decimals, 5));
    TEST_ASSERT_FALSE(are_thousands(small, 5));
    TEST_ASSERT_FALSE(are_thousands(even, 5));
}

static void expect_clock(const char *text, double seconds) {
    double found;
    const char *end;
    TEST_ASSERT_TRUE_MESSAGE(clock_read(text, strlen(text), &found, &end), text);
    TEST_ASSERT_EQUAL_STRING("", end);
    TEST_ASSERT_EQUAL_DOUBLE(seconds, found);
}

static void test_months_in_letters(void) {
    double ignored;
    const char *end;
    expect_clock("29-Nov-2026 10:11:12.5", 1795947072.5);
    expect_clock("29 November 2026 10:11:12.5", 1795947072.5);
    TEST_ASSERT_FALSE(clock_read("29-Nix-2026 10:11:12", 20, &ignored, &end));
    TEST_ASSERT_FALSE(clock_read("32-Nov-2026 10:11:12", 20, &ignored, &end));
}

static void test_exponents_of_fortran(void) {
    double number;
    const char *end;
    TEST_ASSERT_TRUE(decimal_read("1.5D+02;", '.', &number, &end) && *end == ';');
    TEST_ASSERT_EQUAL_DOUBLE(150.0, number);
    TEST_ASSERT_TRUE(decimal_read("-2,25d-300", ',', &number, &end) && *end == '\0'); /* by the library */
    TEST_ASSERT_EQUAL_DOUBLE(-2.25e-300, number);
    TEST_ASSERT_TRUE(decimal_read("5d", '.', &number, &end) && *end == 'd'); /* days */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_words_are_put_together);
    RUN_TEST(test_accents_and_capitals_do_not_matter);
    RUN_TEST(test_an_unknown_word_is_strange);
    RUN_TEST(test_letters_beyond_ascii_of_known_words);
    RUN_TEST(test_cut_letters);
    RUN_TEST(test_scales_in_names);
    RUN_TEST(test_units_before_remarks);
    RUN_TEST(test_thousands_that_look_like_decimals);
    RUN_TEST(test_months_in_letters);
    RUN_TEST(test_exponents_of_fortran);
    return UNITY_END();
}
