/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a paper reports arrives on the page and in the JSON, and what must not stand there fails the run. */
#include "reproduction_page.h"
#include "unity.h"
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static const char folder[] = "reproduction-page";
static reproduction_t reproduction;
static failure_t failure;

void setUp(void) {
    TEST_ASSERT_TRUE_MESSAGE(reproduction_prepare(folder, &failure), failure.text);
}
void tearDown(void) {
    reproduction_free(&reproduction);
}

static bool run(bool (*reproduce)(reproduction_t *), bool reduced) {
    return reproduction_run(&reproduction, "042", "Title", reproduce, folder, reduced, &failure);
}

static bool report_every_criterion(reproduction_t *r) {
    reproduction_row(r, "at most, met", 2.0, 2.0, "%", MET_AT_MOST, 0.0);
    reproduction_row(r, "at most, not met", 2.0, 2.0001, "%", MET_AT_MOST, 0.0);
    reproduction_explain(r, "because of %d things", 2);
    reproduction_row(r, "at least, met", 2.0, 2.0, "%", MET_AT_LEAST, 0.0);
    reproduction_row(r, "at least, not met", 2.0, 1.9999, "%", MET_AT_LEAST, 0.0);
    reproduction_explain(r, "replaced");
    reproduction_explain(r, "not enough");
    reproduction_row(r, "bad result, met", 10.26, 11.0, "%", MET_ABOVE, 0.0);
    reproduction_row(r, "equal | met", -0.525, -0.5253, "um", MET_EQUAL, 0.0005);
    reproduction_explain(r, "never shown");
    reproduction_row(r, "equal, not met", -0.525, -0.3457, "um", MET_EQUAL, 0.0005);
    reproduction_explain(r, "the print is wrong");
    reproduction_row(r, "no number", 1.0, (double)NAN, "um", MET_AT_MOST, 0.0);
    reproduction_explain(r, "there was none");
    reproduction_text(r, "A paragraph about %s.", "the twin");
    return true;
}

static const bool expected_met[] = {true, false, true, false, true, true, false, false};
enum { ROWS = sizeof expected_met / sizeof expected_met[0] };

static char *read_output(const char *name) {
    char path[100];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    char *text = allocate(100000, 1);
    TEST_ASSERT_GREATER_THAN(0, fread(text, 1, 99999, file));
    fclose(file);
    return text;
}

static void test_criteria_decide_what_is_met(void) {
    TEST_ASSERT_TRUE_MESSAGE(run(report_every_criterion, false), failure.text);
    TEST_ASSERT_EQUAL_UINT64(ROWS, reproduction.rows);
    for (size_t i = 0; i < ROWS; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(expected_met[i], reproduction.row[i].met, reproduction.row[i].quantity);
    }
    TEST_ASSERT_EQUAL_UINT64(4, reproduction_met(&reproduction));
}

static void test_json_has_every_row_and_six_keys(void) {
    TEST_ASSERT_TRUE_MESSAGE(run(report_every_criterion, false), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(reproduction_write(&reproduction, 1, folder, &failure), failure.text);
    json_t *list = json_load_file("reproduction-page/reproduction.json", 0, NULL);
    TEST_ASSERT_EQUAL_UINT64(ROWS, json_array_size(list));
    for (size_t i = 0; i < ROWS; i++) {
        const json_t *row = json_array_get(list, i);
        TEST_ASSERT_EQUAL_UINT64(6, json_object_size(row));
        TEST_ASSERT_EQUAL_STRING("042", json_string_value(json_object_get(row, "seed")));
        TEST_ASSERT_EQUAL_STRING(reproduction.row[i].quantity, json_string_value(json_object_get(row, "quantity")));
        TEST_ASSERT_EQUAL_STRING(reproduction.row[i].unit, json_string_value(json_object_get(row, "unit")));
        TEST_ASSERT_TRUE(json_number_value(json_object_get(row, "paper")) == reproduction.row[i].paper);
        TEST_ASSERT_EQUAL(expected_met[i], json_is_true(json_object_get(row, "met")));
    }
    TEST_ASSERT_TRUE(json_number_value(json_object_get(json_array_get(list, 6), "ours")) == -0.3457);
    TEST_ASSERT_TRUE(json_is_null(json_object_get(json_array_get(list, 7), "ours")));
    json_decref(list);
}

static void test_page_shows_what_is_not_met_first_and_why(void) {
    TEST_ASSERT_TRUE_MESSAGE(run(report_every_criterion, false), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(reproduction_write(&reproduction, 1, folder, &failure), failure.text);
    char *page = read_output("REPRODUCTION.md");
    const char *const in_order[] = {"| [042](#042) | Title | 4 | 8 |",
                                    "## 042: Title",
                                    "| at most, not met | ≤ 2 | 2.0001 | %",
                                    "| equal, not met | -0.525 ± 0.0005 | -0.3457 | um | **no** |",
                                    "*at most, not met*: because of 2 things",
                                    "*at least, not met*: not enough",
                                    "*no number*: there was none",
                                    "<details open>",
                                    "| at most, met |",
                                    "≥ 10.26, a bad result",
                                    "| equal \\| met |",
                                    "A paragraph about the twin."};
    const char *at = page;
    for (size_t i = 0; i < sizeof in_order / sizeof in_order[0]; i++) {
        at = strstr(at, in_order[i]);
        TEST_ASSERT_NOT_NULL_MESSAGE(at, in_order[i]);
    }
    TEST_ASSERT_NULL(strstr(page, "never shown"));
    TEST_ASSERT_NULL(strstr(page, "replaced"));
    TEST_ASSERT_NULL(strstr(page, "Reduced"));
    free(page);
}

static bool report_without_reason(reproduction_t *r) {
    reproduction_row(r, "too large", 1.0, 2.0, "um", MET_AT_MOST, 0.0);
    return true;
}

static void test_what_is_not_met_needs_a_reason_at_full_length(void) {
    TEST_ASSERT_FALSE(run(report_without_reason, false));
    TEST_ASSERT_EQUAL_STRING("042: neither met nor explained: too large", failure.text);
    reproduction_free(&reproduction);
    TEST_ASSERT_TRUE(run(report_without_reason, true));
    TEST_ASSERT_TRUE_MESSAGE(reproduction_write(&reproduction, 1, folder, &failure), failure.text);
    char *page = read_output("REPRODUCTION.md");
    TEST_ASSERT_NOT_NULL(strstr(page, "Reduced length"));
    free(page);
}

static bool report_twice(reproduction_t *r) {
    reproduction_row(r, "same", 1.0, 1.0, "um", MET_AT_MOST, 0.0);
    reproduction_row(r, "same", 2.0, 1.0, "um", MET_AT_MOST, 0.0);
    return true;
}

static bool fail_to_run(reproduction_t *r) {
    reproduction_row(r, "good", 1.0, 1.0, "um", MET_AT_MOST, 0.0);
    return false;
}

static bool explain_nothing(reproduction_t *r) {
    reproduction_explain(r, "why");
    return true;
}

static void test_a_run_that_went_wrong_fails(void) {
    TEST_ASSERT_FALSE(run(report_twice, true));
    TEST_ASSERT_EQUAL_STRING("042: two rows are called \"same\"", failure.text);
    reproduction_free(&reproduction);
    TEST_ASSERT_FALSE(run(fail_to_run, true));
    TEST_ASSERT_EQUAL_STRING("042: the run has failed", failure.text);
    reproduction_free(&reproduction);
    TEST_ASSERT_FALSE(run(explain_nothing, true));
}

static bool draw(reproduction_t *r) {
    const double x[] = {0.0, 1.0};
    const plot_line_t line = {.class_name = "after", .label = "ours", .x = x, .y = x, .count = 2};
    const plot_t plot = {
        .title = "line", .x_label = "V", .y_label = "um", .line = &line, .lines = 1, .shade_from = PLOT_NO_SHADE};
    reproduction_picture(r, "loop", "A loop", &plot, 1, 1);
    return true;
}

static bool draw_where_nothing_is(reproduction_t *r) {
    r->output = "reproduction-page/missing";
    return draw(r);
}

static void test_pictures_are_beside_the_page(void) {
    TEST_ASSERT_TRUE_MESSAGE(run(draw, false), failure.text);
    TEST_ASSERT_NOT_NULL(strstr(reproduction.text, "![A loop](pictures/reproduction-042-loop.svg)"));
    char *picture = read_output("pictures/reproduction-042-loop.svg");
    TEST_ASSERT_EQUAL_STRING_LEN("<svg", picture, 4);
    TEST_ASSERT_NOT_NULL(strstr(picture, "polyline class=\"after\""));
    free(picture);
    reproduction_free(&reproduction);
    TEST_ASSERT_FALSE(run(draw_where_nothing_is, false));
}

static bool use_folder(reproduction_t *r) {
    char path[100];
    snprintf(path, sizeof path, "%s/file", reproduction_folder(r));
    FILE *file = fopen(path, "w");
    return file != NULL && fclose(file) == 0;
}

static void test_scratch_folder_can_be_written(void) {
    TEST_ASSERT_TRUE(run(use_folder, true));
    TEST_ASSERT_FALSE(reproduction_prepare("reproduction-page/scratch/missing/folder", &failure));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_criteria_decide_what_is_met);
    RUN_TEST(test_json_has_every_row_and_six_keys);
    RUN_TEST(test_page_shows_what_is_not_met_first_and_why);
    RUN_TEST(test_what_is_not_met_needs_a_reason_at_full_length);
    RUN_TEST(test_a_run_that_went_wrong_fails);
    RUN_TEST(test_pictures_are_beside_the_page);
    RUN_TEST(test_scratch_folder_can_be_written);
    return UNITY_END();
}
