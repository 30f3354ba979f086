/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a picture may not lose, and what must not break it. */
#include "page/svg_plot.h"
#include <stdlib.h>
#include <string.h>
#include <unity.h>

#define POINTS 20000

static double x[POINTS], y[POINTS];
static char *text;
static size_t length;

void setUp(void) {
    text = NULL;
}

void tearDown(void) {
    free(text);
}

static void draw(const plot_line_t *line, size_t lines, const char *title, double shade_from) {
    FILE *file = open_memstream(&text, &length);
    TEST_ASSERT_NOT_NULL(file);
    plot_write(file, &(plot_t){title, "time, s", "error, um", line, lines, shade_from});
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

/* Number of points of the first polyline; their range in picture coordinates. */
static size_t points_drawn(double *left, double *right, double *top, double *bottom) {
    const char *at = strstr(text, "points=\"");
    TEST_ASSERT_NOT_NULL(at);
    at += strlen("points=\"");
    size_t count = 0;
    *left = *top = HUGE_VAL;
    *right = *bottom = -HUGE_VAL;
    while (*at != '"') {
        char *next = NULL;
        const double px = strtod(at, &next);
        TEST_ASSERT_EQUAL_INT(',', *next);
        const double py = strtod(next + 1, &next);
        TEST_ASSERT_EQUAL_INT(' ', *next);
        at = next + 1;
        *left = fmin(*left, px);
        *right = fmax(*right, px);
        *top = fmin(*top, py);
        *bottom = fmax(*bottom, py);
        count++;
    }
    return count;
}

static void test_one_sample_spike_keeps_its_height(void) {
    for (size_t k = 0; k < POINTS; k++) {
        x[k] = (double)k;
        y[k] = 0.0;
    }
    y[7777] = 1.0;
    y[15555] = -1.0;
    const plot_line_t line = {"after", "a", x, y, POINTS};
    draw(&line, 1, "spikes", PLOT_NO_SHADE);
    double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
    const size_t count = points_drawn(&left, &right, &top, &bottom);
    /* The axes are 5 % wider than the data: 262 units of height show -1.1 to 1.1. Coordinates have one decimal. */
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 262.0 * 2.0 / 2.2, bottom - top);
    TEST_ASSERT_TRUE(count <= 4 * 383); /* up to four points in each column of pixels */
}

static void test_picture_does_not_grow_with_a_smooth_curve(void) {
    for (size_t k = 0; k < POINTS; k++) {
        x[k] = cos(6.283185307179586 * (double)k / POINTS);
        y[k] = sin(6.283185307179586 * (double)k / POINTS);
    }
    const plot_line_t line = {"after", "a", x, y, POINTS};
    draw(&line, 1, "circle", PLOT_NO_SHADE);
    double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
    const size_t count = points_drawn(&left, &right, &top, &bottom);
    TEST_ASSERT_TRUE(count > 382 && count <= 2 * 4 * 383); /* 383 columns of pixels, up to four points in each, twice */
    TEST_ASSERT_TRUE(left >= 66.0 && right <= 448.0 && top >= 14.0 && bottom <= 276.0);
}

static void test_flat_and_tiny_and_huge_data_have_axes(void) {
    const double scale[] = {0.0, 1e-12, 1e12, -1e300};
    for (size_t i = 0; i < sizeof scale / sizeof scale[0]; i++) {
        for (size_t k = 0; k < 10; k++) {
            x[k] = (double)k;
            y[k] = scale[i];
        }
        const plot_line_t line = {"after", "a", x, y, 10};
        draw(&line, 1, "flat", PLOT_NO_SHADE);
        TEST_ASSERT_NULL_MESSAGE(strstr(text, "nan"), text);
        TEST_ASSERT_NULL_MESSAGE(strstr(text, "inf"), text);
        TEST_ASSERT_NOT_NULL(strstr(text, "tick level"));
        free(text);
        text = NULL;
    }
}

/* "-0.005" is 42 units wide, and a vertical label has 4 of its 13 behind its foot. */
static void test_ticks_do_not_reach_the_label(void) {
    const plot_line_t line = {"after", "a", x, y, 2};
    x[0] = y[0] = 0.0;
    x[1] = 1.0;
    y[1] = -0.015;
    draw(&line, 1, "small", PLOT_NO_SHADE);
    const char *tick = strstr(text, "<text class=\"tick level\" x=\""), *label = strstr(text, "translate(");
    TEST_ASSERT_NOT_NULL(strstr(text, ">-0.005</text>"));
    TEST_ASSERT_NOT_NULL(tick);
    TEST_ASSERT_NOT_NULL(label);
    const double ends = strtod(tick + strlen("<text class=\"tick level\" x=\""), NULL);
    TEST_ASSERT_TRUE(ends - 42.0 > strtod(label + strlen("translate("), NULL) + 4.0);
}

static void test_text_cannot_break_the_page(void) {
    const plot_line_t line = {"after", "<script>", x, y, 2};
    const plot_line_t lines[] = {line, line};
    x[0] = y[0] = 0.0;
    x[1] = y[1] = 1.0;
    draw(lines, 2, "a<b>&\"c\"", PLOT_NO_SHADE);
    TEST_ASSERT_NULL(strstr(text, "<script>"));
    TEST_ASSERT_NOT_NULL(strstr(text, "a&lt;b&gt;&amp;&quot;c&quot;"));
}

static void test_shade_lies_inside_the_frame(void) {
    const plot_line_t line = {"after", "a", x, y, 2};
    x[0] = y[0] = 0.0;
    x[1] = y[1] = 1.0;
    draw(&line, 1, "shaded", 0.5);
    const char *rectangle = strstr(text, "<rect class=\"shade\" x=\"");
    TEST_ASSERT_NOT_NULL(rectangle);
    /* The middle of the frame, 66 to 448. */
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 257.0, strtod(rectangle + strlen("<rect class=\"shade\" x=\""), NULL));
}

static void test_nothing_to_draw_draws_nothing(void) {
    const plot_line_t line = {"after", "a", x, y, 0};
    draw(&line, 1, "empty", PLOT_NO_SHADE);
    TEST_ASSERT_EQUAL_UINT64(0U, length);
}

static size_t occurrences(const char *part) {
    size_t count = 0;
    for (const char *at = strstr(text, part); at != NULL; at = strstr(at + 1, part)) {
        count++;
    }
    return count;
}

/* A line's label stands where its plot is: once on top if all plots have the same lines, else at each plot. */
static void test_a_sheet_has_the_legend_that_its_plots_have(void) {
    const plot_line_t first = {"after", "ours", x, y, 2}, second = {"before", "theirs", x, y, 2};
    plot_t plots[2] = {{"A", "s", "um", &first, 1, PLOT_NO_SHADE}, {"B", "s", "um", &first, 1, PLOT_NO_SHADE}};
    x[0] = y[0] = 0.0;
    x[1] = y[1] = 1.0;
    for (size_t labels = 1; labels <= 2; labels++) {
        plots[1].line = labels == 1 ? &first : &second;
        FILE *file = open_memstream(&text, &length);
        TEST_ASSERT_NOT_NULL(file);
        plot_write_sheet(file, plots, 2, 2);
        TEST_ASSERT_EQUAL_INT(0, fclose(file));
        TEST_ASSERT_EQUAL_UINT64(1, occurrences(">ours<"));
        TEST_ASSERT_EQUAL_UINT64(labels - 1, occurrences(">theirs<"));
        TEST_ASSERT_EQUAL(labels == 1, strstr(text, ">ours<") < strstr(text, ">A<"));
        TEST_ASSERT_EQUAL(labels == 2, strstr(text, ">theirs<") > strstr(text, ">B<"));
        free(text);
        text = NULL;
    }
}

/* A single plot fills its picture, whatever room for others there is. */
static void test_a_sheet_has_no_empty_columns(void) {
    const plot_line_t line = {"after", "ours", x, y, 2};
    const plot_t plot = {"A", "s", "um", &line, 1, PLOT_NO_SHADE};
    char *narrow = NULL;
    x[0] = y[0] = 0.0;
    x[1] = y[1] = 1.0;
    for (size_t columns = 1; columns <= 3; columns++) {
        FILE *file = open_memstream(&text, &length);
        TEST_ASSERT_NOT_NULL(file);
        plot_write_sheet(file, &plot, 1, columns);
        TEST_ASSERT_EQUAL_INT(0, fclose(file));
        if (columns == 1) {
            narrow = text;
        } else {
            TEST_ASSERT_EQUAL_STRING(narrow, text);
            free(text);
        }
        text = NULL;
    }
    free(narrow);
}

/* Decades are equally far apart, and a tick stands at each. */
static void test_logarithmic_axes(void) {
    const double decades[] = {1e-4, 1e-2, 1.0, 1e2}, ones[] = {3.0, 3.0, 3.0, 5.0};
    const plot_line_t line = {"after", "a", decades, ones, 4};
    double at[4], left, right, top, bottom;
    FILE *file = open_memstream(&text, &length);
    TEST_ASSERT_NOT_NULL(file);
    plot_write_logarithmic(file, &(plot_t){"t", "x", "y", &line, 1, PLOT_NO_SHADE});
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    const char *point = strstr(text, "points=\"") + strlen("points=\"");
    for (size_t k = 0; k < 4; k++) {
        at[k] = strtod(point, NULL);
        point = strchr(point, ' ') + 1;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.15, at[1] - at[0], at[2] - at[1]); /* a coordinate has one digit behind the point */
    TEST_ASSERT_DOUBLE_WITHIN(0.15, at[1] - at[0], at[3] - at[2]);
    TEST_ASSERT_EQUAL_UINT64(4, points_drawn(&left, &right, &top, &bottom));
    TEST_ASSERT_NOT_NULL(strstr(text, ">1e-4<"));
    TEST_ASSERT_NOT_NULL(strstr(text, ">1e-2<")); /* one way of writing on an axis */
    TEST_ASSERT_NULL(strstr(text, ">0.01<"));
    TEST_ASSERT_NOT_NULL(strstr(text, ">1e2<"));
    TEST_ASSERT_NOT_NULL(strstr(text, "tick level")); /* though the levels do not reach a decade */
}

/* Where none of them is long, they are plain numbers. */
static void test_short_decades_are_plain_numbers(void) {
    const double decades[] = {1e-2, 1e4}, ones[] = {1.0, 5.0};
    const plot_line_t line = {"after", "a", decades, ones, 2};
    FILE *file = open_memstream(&text, &length);
    TEST_ASSERT_NOT_NULL(file);
    plot_write_logarithmic(file, &(plot_t){"t", "x", "y", &line, 1, PLOT_NO_SHADE});
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    TEST_ASSERT_NOT_NULL(strstr(text, ">0.01<"));
    TEST_ASSERT_NOT_NULL(strstr(text, ">10000<"));
    TEST_ASSERT_NULL(strstr(text, ">1e"));
}

static void count_of(const char *part, size_t expected) {
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(expected, occurrences(part), part);
}

/* Noise over time is a band from its lowest to its highest value; a slow curve of as many samples is a line. */
static void test_a_trace_denser_than_the_pixels_is_a_band(void) {
    static double slow[POINTS];
    for (size_t k = 0; k < POINTS; k++) {
        x[k] = (double)k;
        y[k] = k % 2 == 0 ? 1.0 : -1.0;
        slow[k] = sin(6.283185307179586 * 3.0 * (double)k / POINTS);
    }
    y[9999] = 3.0;
    const plot_line_t lines[] = {{"before", "dense", x, y, POINTS}, {"after", "slow", x, slow, POINTS}};
    draw(lines, 2, "both", PLOT_NO_SHADE);
    count_of("<path class=\"band before\"", 1);
    count_of("<polyline class=\"after\"", 1);
    count_of("<polyline", 1);
    /* The spike of one sample is the top of the band: -1 to 3 are 262 units but for 5 % on either side. */
    char *at = strchr(strstr(text, "band before"), 'M') + 1, *next;
    double top = HUGE_VAL, bottom = -HUGE_VAL;
    while (*at != 'Z') {
        strtod(at, &next);
        const double level = strtod(next, &next);
        top = fmin(top, level);
        bottom = fmax(bottom, level);
        at = next + 1;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 262.0 / 1.1, bottom - top);
}

/* A loop keeps its two branches however often it is repeated; where a spread says as much, it is one. */
static void test_a_loop_stays_a_line(void) {
    for (size_t k = 0; k < POINTS; k++) {
        x[k] = cos(6.283185307179586 * 50.0 * (double)k / POINTS);
        y[k] = sin(6.283185307179586 * 50.0 * (double)k / POINTS) * (double)(k % 97) / 96.0;
    }
    plot_line_t line = {"before", "loop", x, y, POINTS};
    draw(&line, 1, "loop", PLOT_NO_SHADE);
    count_of("band before", 0);
    free(text);
    line.class_name = "before spread";
    draw(&line, 1, "loop", PLOT_NO_SHADE);
    count_of("<path class=\"band before spread\"", 1);
    free(text);
    for (size_t k = 0; k < POINTS; k++) { /* but a single outline leaves most of what it encloses empty */
        y[k] = sin(6.283185307179586 * 50.0 * (double)k / POINTS);
    }
    draw(&line, 1, "loop", PLOT_NO_SHADE);
    count_of("<path class=\"band", 0);
}

/* 2 to 9 of each decade; 2 and 5 with their numbers where there are few decades. */
static void test_minor_ticks(void) {
    const double hz[] = {1.0, 1000.0}, level[] = {1.0, 6.0};
    const plot_line_t line = {"after", "a", hz, level, 2};
    FILE *file = open_memstream(&text, &length);
    TEST_ASSERT_NOT_NULL(file);
    plot_write_logarithmic(file, &(plot_t){"t", "x", "y", &line, 1, PLOT_NO_SHADE});
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    count_of("v4\"/>", 3 * 8 + 1); /* and 0.9, as the axis is a little wider */
    count_of("h-4\"/>", 5);
    count_of(">100</text>", 1);
    count_of(">200</text>", 0);
    count_of(">2</text>", 1); /* of the levels */
    count_of(">5</text>", 1);
    free(text);
    text = NULL;
    file = open_memstream(&text, &length);
    TEST_ASSERT_NOT_NULL(file);
    plot_write_over_frequency(file, &(plot_t){"t", "x", "y", &line, 1, PLOT_NO_SHADE});
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    count_of("v4\"/>", 3 * 8 + 1); /* and 0.9, as the axis is a little wider */
    count_of("h-4\"/>", 0);        /* the levels are linear */
}

/* The numbers beside a picture: all of few, of many the extremes of each stretch, and how many there were. */
static void test_data_keep_the_extremes(void) {
    for (size_t k = 0; k < POINTS; k++) {
        x[k] = (double)k;
        y[k] = 0.0;
    }
    y[12345] = 7.25;
    y[12346] = -3.5;
    const plot_line_t lines[] = {{"after", "a</script>", x, y, POINTS}, {"before", "b", x, x, 3}};
    draw(lines, 2, "data", PLOT_NO_SHADE);
    char *data = strstr(text, "class=\"data\"");
    TEST_ASSERT_NOT_NULL(data);
    TEST_ASSERT_NOT_NULL(strstr(data, "7.25"));
    TEST_ASSERT_NOT_NULL(strstr(data, "-3.5"));
    TEST_ASSERT_NOT_NULL(strstr(data, "\"of\":20000"));
    TEST_ASSERT_NOT_NULL(strstr(data, "\"of\":3,\"x\":[0,1,2],\"y\":[0,1,2]"));
    count_of("</script>", 1);
    size_t commas = 0;
    for (const char *at = strstr(data, "\"y\":["); *at != ']'; at++) {
        commas += *at == ',' ? 1 : 0;
    }
    TEST_ASSERT_TRUE(commas < 2500);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_one_sample_spike_keeps_its_height);
    RUN_TEST(test_picture_does_not_grow_with_a_smooth_curve);
    RUN_TEST(test_flat_and_tiny_and_huge_data_have_axes);
    RUN_TEST(test_ticks_do_not_reach_the_label);
    RUN_TEST(test_text_cannot_break_the_page);
    RUN_TEST(test_shade_lies_inside_the_frame);
    RUN_TEST(test_a_sheet_has_the_legend_that_its_plots_have);
    RUN_TEST(test_a_sheet_has_no_empty_columns);
    RUN_TEST(test_logarithmic_axes);
    RUN_TEST(test_short_decades_are_plain_numbers);
    RUN_TEST(test_a_trace_denser_than_the_pixels_is_a_band);
    RUN_TEST(test_a_loop_stays_a_line);
    RUN_TEST(test_minor_ticks);
    RUN_TEST(test_data_keep_the_extremes);
    RUN_TEST(test_nothing_to_draw_draws_nothing);
    return UNITY_END();
}
