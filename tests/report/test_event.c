/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Since when the error of a record is larger than usual. */
#include "report/event_page.h"
#include "unity.h"
#include <math.h>

#define RATE_HZ  1000.0
#define WARNED_S 1.2
#define JUDGED_S 0.3

static recording_t record;

void setUp(void) {
    recording_create(&record, "record", RATE_HZ, 2000);
    (void)recording_add_column(&record, COLUMN_REFERENCE);
}
void tearDown(void) {
    recording_free(&record);
}

/* A sine of 20 Hz, of this root mean square, before and after. */
static void fill(double changed_s, double before_um, double after_um) {
    for (size_t i = 0; i < record.samples; i++) {
        const double t = (double)i / RATE_HZ;
        record.column[COLUMN_REFERENCE][i] = 10.0 * t;
        record.column[COLUMN_DISPLACEMENT][i] =
            10.0 * t + sqrt(2.0) * (t < changed_s ? before_um : after_um) * sin(2.0 * acos(-1.0) * 20.0 * t);
    }
}

static void test_the_change_is_dated_to_a_tenth_of_a_second(void) {
    for (int step = 0; step < 11; step++) {
        const double changed_s = 0.15 + 0.07 * step;
        fill(changed_s, 0.01, 0.05);
        const double since_s = event_since_s(&record, WARNED_S, JUDGED_S, 0.01, 0.02);
        TEST_ASSERT_DOUBLE_WITHIN(EVENT_SINCE_S, changed_s, since_s);
        TEST_ASSERT_TRUE(since_s + EVENT_SINCE_S >= changed_s); /* what follows it by that time has changed */
    }
}

/* By then it had grown, whatever the error does afterwards. */
static void test_a_quiet_stretch_after_the_change(void) {
    fill(0.6, 0.01, 0.05);
    for (size_t i = 1050; i < 1200; i++) {
        record.column[COLUMN_DISPLACEMENT][i] = record.column[COLUMN_REFERENCE][i];
    }
    TEST_ASSERT_DOUBLE_WITHIN(EVENT_SINCE_S, 0.6, event_since_s(&record, WARNED_S, JUDGED_S, 0.01, 0.02));
}

static void test_a_change_before_the_record_has_no_date(void) {
    fill(-1.0, 0.01, 0.05);
    TEST_ASSERT_TRUE(isnan(event_since_s(&record, WARNED_S, JUDGED_S, 0.01, 0.02)));
}

static void test_dates(void) {
    char text[EVENT_TIME];
    event_time_text((time_t)1700000000, text);
    TEST_ASSERT_EQUAL_STRING("2023-11-14T22:13:20Z", text);
}

static void expect_supply(double before_v, double now_v, const char *text) {
    const event_t event = {.usual_supply_v = before_v, .supply_v = now_v};
    char told[EVENT_SUPPLY];
    event_supply_text(&event, told);
    TEST_ASSERT_EQUAL_STRING(text, told);
}

static void test_the_supply(void) {
    expect_supply(150.0, 118.2, "The high-voltage supply fell from 150 V to 118.2 V.");
    expect_supply(118.2, 150.01, "The high-voltage supply rose from 118.2 V to 150 V.");
    expect_supply(149.99, 150.01, "The high-voltage supply is 150 V, as before.");
    expect_supply((double)NAN, 150.0, "");
    expect_supply(150.0, (double)NAN, "");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_change_is_dated_to_a_tenth_of_a_second);
    RUN_TEST(test_a_quiet_stretch_after_the_change);
    RUN_TEST(test_a_change_before_the_record_has_no_date);
    RUN_TEST(test_dates);
    RUN_TEST(test_the_supply);
    return UNITY_END();
}
