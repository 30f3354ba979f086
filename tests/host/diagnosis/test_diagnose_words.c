/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What people get of a diagnosis: the text on the terminal and the page; and the same facts in JSON. */
#include "base/shown_name.h"
#include "report/advice.h"
#include "told_diagnosis.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char *contents(const char *path) {
    FILE *file = fopen(path, "r");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_INT(0, fseek(file, 0, SEEK_END));
    const size_t length = (size_t)ftell(file);
    char *text = allocate(length + 1, 1);
    rewind(file);
    TEST_ASSERT_EQUAL_UINT64(length, fread(text, 1, length, file));
    fclose(file);
    return text;
}

/* What diagnosis_print writes, to be freed. */
static char *printed(void) {
    FILE *file = fopen("printed.txt", "w");
    TEST_ASSERT_NOT_NULL(file);
    diagnosis_print(file, &diagnosis, &account, recordings, RECORDINGS);
    fclose(file);
    return contents("printed.txt");
}

static char *page(void) {
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, NULL, "page.html", &failure));
    return contents("page.html");
}

static void expect_all(char *text, const char *const *parts, size_t count) {
    for (size_t i = 0; i < count; i++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, parts[i]), parts[i]);
    }
    free(text);
}

/* In no order; among them what was found, what may be it, and what no number is proportional to at its best. */
static void set_unseen(void) {
    const unseen_t unseen[] = {
        {.block = &block_thermal_drift, .why = "the drive was at home", .smallest_um = HUGE_VAL, .value = 1.0},
        {.block = &block_static_nonlinearity, .testable = true, .smallest_um = 0.5},
        {.block = &block_creep, .testable = true, .smallest_um = 0.00212, .value = -0.00041},
        {.block = &block_resonance, .testable = true, .smallest_um = 0.01, .parameter = 2},
        {.block = &block_sensor_bandwidth, .testable = true, .smallest_um = 0.01, .parameter = 1},
        {.block = &block_transport_delay, .testable = true, .smallest_um = 0.0314, .value = 0.00025}};
    memcpy(diagnosis.unseen, unseen, sizeof unseen);
    diagnosis.unseen_count = sizeof unseen / sizeof unseen[0];
    diagnosis.finding[0].certainty = ISOLATED;
    diagnosis.finding[0].rivals = 1;
    diagnosis.finding[0].rival[0] = &block_sensor_bandwidth;
}

static void test_what_is_isolated_is_not_sold_as_a_name(void) {
    char text[DIAGNOSIS_LINE];
    finding_t *finding = &diagnosis.finding[0];
    finding->certainty = ISOLATED; /* and no rival */
    finding_explanation(finding, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "More than noise remains, which may be the reason in its place."));
    finding->shape = true;
    finding_explanation(finding, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "A bend of the hysteresis itself may be the reason in its place."));
    finding->shape = false;
    finding->rivals = 2;
    finding->rival[0] = &block_transport_delay;
    finding->rival[1] = &block_sensor_bandwidth;
    finding->margin = 3.0;
    finding_explanation(finding, text);
    TEST_ASSERT_NOT_NULL(
        strstr(text, "One of resonance, transport_delay and sensor_bandwidth; these recordings cannot tell which"));
    diagnosis.considered = 3;
    diagnosis.consideration[1] = (considered_t){.block = &block_transport_delay, .round = 1, .outcome = LESS_LIKELY};
    diagnosis.consideration[2] = (considered_t){.block = &block_creep, .round = 1, .outcome = LESS_LIKELY};
    TEST_ASSERT_EQUAL_STRING("taken", outcome_text(&diagnosis, 0));
    TEST_ASSERT_EQUAL_STRING("cannot be distinguished from the best", outcome_text(&diagnosis, 1));
    TEST_ASSERT_EQUAL_STRING("explains less than the best", outcome_text(&diagnosis, 2));
    diagnosis.consideration[2].outcome = SUPERFLUOUS;
    TEST_ASSERT_EQUAL_STRING("superfluous beside the others, or none of its numbers determined",
                             outcome_text(&diagnosis, 2));
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "resonance (or transport_delay, sensor_bandwidth)"));
    work_out();
    json_t *json = as_json(), *first = json_array_get(json_object_get(json, "findings"), 0);
    TEST_ASSERT_EQUAL_UINT64(2, json_array_size(json_object_get(first, "confusable_with")));
    TEST_ASSERT_EQUAL_STRING("isolated", json_string_value(json_object_get(first, "certainty")));
    json_decref(json);
    account_free(&account);
}

static void test_what_was_not_found_tells_its_smallest_size(void) {
    const char *const told[] = {
        "\nnot seen, beside what was found; sizes are those of the form of each block that shows best here\n"
        "   transport_delay            would have been seen from 0.031 um rms (delay 250 us)\n"
        "   creep                      would have been seen from 0.0021 um rms (gamma per decade 0.00041)\n"
        "   static_nonlinearity        would have been seen from 0.5 um rms\n"
        "   thermal_drift              not testable here: the drive was at home\n",
        "\nnext       hyst record --port DEV --probe resonance\nchain ", /* before what led to it */
        "edges: hyst record --port DEV --probe resonance\n"};
    const char *const shown[] = {"<td>creep</td><td>0.0021&nbsp;µm rms (gamma per decade 0.00041)</td>",
                                 "<td>thermal_drift</td><td>not testable here: the drive was at home</td>",
                                 ": <code>hyst record --port DEV --probe resonance</code></dd>"};
    const char *const hedged[] = {"more than noise remains, and may hide effects of any size\n   thermal_drift"};
    const char *const shown_hedged[] = {"<td>creep</td><td>no limit</td>", "More than noise remains, and may hide"};
    const char *name, *excitation, *probe, *parameter, *unit, *reason;
    double smallest, value;
    int testable;
    set_unseen();
    work_out();
    json_t *json = as_json(), *list = json_object_get(json, "not_found");
    TEST_ASSERT_EQUAL_UINT64(4, json_array_size(list));
    expect_format(json_array_get(list, 1), "{s:s, s:b, s:n, s:f, s:{s:s, s:f, s:s}, s:s, s:s}", "block", &name,
                  "testable", &testable, "reason", "smallest_um", &smallest, "parameter", "name", &parameter, "value",
                  &value, "unit", &unit, "separating_excitation", &excitation, "probe", &probe);
    TEST_ASSERT_EQUAL_STRING("creep", name);
    TEST_ASSERT_EQUAL_STRING("gamma_per_decade", parameter);
    TEST_ASSERT_EQUAL_STRING("hyst record --probe creep", probe);
    TEST_ASSERT_TRUE(testable && smallest == 0.00212 && value == 0.00041);
    expect_format(json_array_get(list, 2), "{s:s, s:b, s:n, s:f, s:n, s:s, s:s}", "block", &name, "testable", &testable,
                  "reason", "smallest_um", &smallest, "parameter", "separating_excitation", &excitation, "probe",
                  &probe);
    TEST_ASSERT_EQUAL_STRING("static_nonlinearity", name);
    expect_format(json_array_get(list, 3), "{s:s, s:b, s:s, s:n, s:n, s:s, s:s}", "block", &name, "testable", &testable,
                  "reason", &reason, "smallest_um", "parameter", "separating_excitation", &excitation, "probe", &probe);
    TEST_ASSERT_EQUAL_STRING("thermal_drift", name);
    TEST_ASSERT_EQUAL_STRING("the drive was at home", reason);
    TEST_ASSERT_FALSE(testable);
    expect_all(printed(), told, 2);
    expect_all(page(), shown, 3);
    diagnosis.remainder.structured = true;
    expect_all(printed(), hedged, 1);
    expect_all(page(), shown_hedged, 2);
    json_decref(json);
    json = as_json();
    TEST_ASSERT_TRUE(
        json_is_null(json_object_get(json_array_get(json_object_get(json, "not_found"), 1), "smallest_um")));
    diagnosis.finding[0].certainty = NAMED;
    TEST_ASSERT_EQUAL_STRING("all", next_probe(&diagnosis));
    json_decref(json);
    account_free(&account);
}

/* A model that was given is told apart from what its own hysteresis, fitted again, makes of it. */
static void test_only_a_given_model_came_in(void) {
    const char *const told[] = {"NRMSE 1.9000 % -> 0.9000 % -> 0.1000 %, held out 2.0000 % -> 1.0000 % -> 0.1000 %",
                                "(the chain as it came in -> its numbers fitted again -> with what was found)"};
    const char *const shown[] = {"as it came in</td><td>2.0000", "numbers fitted again</td><td>1.0000",
                                 "1.9000&nbsp;% as it came in, 0.9000&nbsp;% before"};
    const char *const begun[] = {"NRMSE 0.9000 % -> 0.1000 %, held out 1.0000 % -> 0.1000 %; noise"};
    work_out();
    expect_all(printed(), told, 2);
    expect_all(page(), shown, 3);
    question->model_given = false;
    diagnosis.family = families[0];
    json_t *json = as_json();
    TEST_ASSERT_TRUE(json_is_null(json_object_get(json, "given")));
    json_decref(json);
    expect_all(printed(), begun, 1);
    char *text = page();
    TEST_ASSERT_NULL(strstr(text, "as it came in"));
    free(text);
    account_free(&account);
}

/* What became of a given chain: the shape of its hysteresis, and the numbers of its other blocks. */
static void test_what_was_changed_in_a_given_chain_is_told(void) {
    static const char same[] = "Explained by a hysteresis of other numbers (prandtl_ishlinskii) and resonance: the "
                               "held-out error falls from 1.5 % to 0.1 %",
                      other[] = "Explained by another shape of hysteresis (prandtl_ishlinskii): the held-out error";
    char text[DIAGNOSIS_LINE];
    work_out();
    diagnosis.family = families[0];
    diagnosis.own_shape_held_out_percent = 1.5;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING_LEN(same, text, strlen(same));
    model_remove(&diagnosis.given, 0);
    model_set(model_append(&diagnosis.given, &block_bouc_wen), "offset_um", 1.0);
    model_block_t *mode = model_append(&diagnosis.given, &block_resonance);
    model_set(mode, "frequency_hz", 150.0);
    model_set(mode, "damping_ratio",
              *model_parameter(model_find(&diagnosis.model, "resonance"), "damping_ratio")->value);
    diagnosis.refitted = 1;
    diagnosis.refitted_block[0] = &block_resonance;
    diagnosis.findings = 0;
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING_LEN(other, text, strlen(other));
    char *all = printed();
    TEST_ASSERT_NOT_NULL(strstr(all, "\nrefitted   resonance in the given chain: frequency 180"));
    TEST_ASSERT_NOT_NULL(strstr(all, "it was 150 Hz\n"));
    TEST_ASSERT_NULL(strstr(all, "chain: damping ratio"));
    free(all);
    const char *const shown[] = {"numbers fitted again</td><td>1.5000", "another hysteresis</td><td>1.0000",
                                 "hysteresis, in place of the given one",
                                 "Fitted again: resonance in the given chain: frequency 180"};
    expect_all(page(), shown, 4);
    json_t *json = as_json();
    const json_t *shape = json_object_get(json, "other_shape"), *numbers = json_object_get(json, "refitted");
    TEST_ASSERT_EQUAL_STRING("bouc_wen", json_string_value(json_object_get(shape, "instead_of")));
    TEST_ASSERT_EQUAL_UINT64(2, json_array_size(numbers));
    TEST_ASSERT_TRUE(json_is_true(json_object_get(json_array_get(numbers, 0), "changed")));
    TEST_ASSERT_FALSE(json_is_true(json_object_get(json_array_get(numbers, 1), "changed")));
    json_decref(json);
    account_free(&account);
}

static void expect_remainder(remainder_t remainder, const char *expected) {
    char text[DIAGNOSIS_LINE];
    diagnosis.remainder = remainder;
    remainder_text(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_what_remains_is_told_in_words(void) {
    const char
        *const told[] = {"\nremaining  0.012 um rms beside the noise, most of it at 2 .. 2.8 Hz; 5 single samples "},
               *const shown[] = {
                   "<p>The model leaves 0.012&nbsp;µm rms beside the noise, most of it at 2&nbsp;to&nbsp;2.8 Hz; 5"};
    double low, high;
    expect_remainder((remainder_t){0}, "noise at all frequencies");
    expect_remainder((remainder_t){.outliers = 1},
                     "noise at all frequencies; 1 single sample far outside the noise: too little to ask for a reason");
    expect_remainder((remainder_t){.rms_um = 0.0004, .low_hz = 10.0, .high_hz = 14.1},
                     "0.0004 um rms beside the noise, most of it at 10 .. 14.1 Hz: too little to ask for a reason");
    expect_remainder((remainder_t){.outliers = 9, .structured = true},
                     "noise at all frequencies; 9 single samples far outside the noise");
    expect_remainder((remainder_t){.by_level = {.part = 0.1, .low_um = 2.0, .high_um = 3.0}},
                     "noise at all frequencies; 0.1 of the noise goes with the position, most of it at 2 .. 3 um: too "
                     "little to ask for a reason");
    diagnosis.remainder = (remainder_t){.rms_um = 0.012,
                                        .low_hz = 2.0,
                                        .high_hz = 2.83,
                                        .outliers = 5,
                                        .by_level = {.part = 0.25, .low_um = 1.0, .high_um = 4.0},
                                        .structured = true};
    work_out();
    json_t *json = as_json(), *remaining = json_object_get(json, "remaining");
    expect_format(json_object_get(remaining, "band_hz"), "[f, f]", &low, &high);
    TEST_ASSERT_TRUE(low == 2.0 && high == 2.83);
    TEST_ASSERT_EQUAL_INT(5, json_integer_value(json_object_get(remaining, "outliers")));
    TEST_ASSERT_EQUAL_DOUBLE(0.012, json_number_value(json_object_get(remaining, "rms_um")));
    TEST_ASSERT_EQUAL_DOUBLE(0.25, json_number_value(json_object_get(remaining, "by_level")));
    expect_format(json_object_get(remaining, "levels_um"), "[f, f]", &low, &high);
    TEST_ASSERT_TRUE(low == 1.0 && high == 4.0);
    TEST_ASSERT_TRUE(json_is_true(json_object_get(remaining, "structured")));
    expect_all(printed(), told, 1);
    expect_all(page(), shown, 1);
    json_decref(json);
    account_free(&account);
}

static void test_an_unknown_past_is_told(void) {
    static const char sentence[] = "those beyond what drives before the recording left in it";
    work_out();
    for (int unknown = 0; unknown < 2; unknown++) {
        question->samples.past_matters = unknown != 0;
        json_t *json = as_json(), *told = json_object_get(json_object_get(json, "remaining"), "past_unknown");
        char *text = printed(), *html = page();
        TEST_ASSERT_EQUAL_INT(unknown, json_is_true(told));
        TEST_ASSERT_EQUAL_INT(unknown, strstr(text, sentence) != NULL);
        TEST_ASSERT_EQUAL_INT(unknown, strstr(html, sentence) != NULL);
        free(text);
        free(html);
        json_decref(json);
    }
    account_free(&account);
}

/* For who has given -o, the advice has the file, and not -o. */
static void test_the_better_model_is_named_where_it_was_written(void) {
    char text[DIAGNOSIS_LINE];
    advice_on_verdict(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING("Use the better model, which hyst diagnose writes with -o BETTER.json.", text);
    diagnosis.written_to = "models/new.json";
    advice_on_verdict(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING("Use the better model, which was written to models/new.json.", text);
    diagnosis.verdict = PARTLY_EXPLAINED;
    work_out();
    const char *const parts[] = {"which was written to models/new.json. Something else is there, too.",
                                 "hyst compile models/new.json, then hyst push"};
    expect_all(page(), parts, 2);
    account_free(&account);
    shown_name_set(diagnosis.written_to, "standard output");
    advice_on_verdict(&diagnosis, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "which was written to standard output."));
    advice_on_block(&diagnosis, &block_resonance, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "hyst compile BETTER.json"));
}

static void test_nothing_found(void) {
    char text[DIAGNOSIS_LINE];
    model_free(&diagnosis.model);
    model_copy(&diagnosis.model, &diagnosis.baseline);
    diagnosis.findings = 0;
    diagnosis.verdict = NOTHING_MISSING;
    work_out();
    json_t *json = as_json();
    TEST_ASSERT_EQUAL_UINT64(0, json_array_size(json_object_get(json, "findings")));
    TEST_ASSERT_EQUAL_STRING("nothing missing", json_string_value(json_object_get(json, "verdict")));
    verdict_sentence(&diagnosis, text);
    TEST_ASSERT_NOT_NULL(strstr(text, "Nothing is missing"));
    char *shown = page();
    TEST_ASSERT_NULL(strstr(shown, "Before and after"));
    TEST_ASSERT_NULL(strstr(shown, "<polyline class=\"before")); /* there is only one model to show */
    TEST_ASSERT_NOT_NULL(strstr(shown, "<polyline class=\"after\""));
    free(shown);
    json_decref(json);
    account_free(&account);
}

/* The parts of the page in the order of a report: each behind the one before. */
static void test_page_has_its_order(void) {
    static const char *const parts[] = {"class=\"verdict\"",
                                        "<h2>What to do now</h2>",
                                        "resonance: the amplifier undoes it",
                                        "<code>hyst record --port DEV --probe ",
                                        "<h2>Before and after</h2>",
                                        "Held-out error",
                                        "<strong>Loop</strong>",
                                        "<strong>Error over the drive</strong>",
                                        "<strong>Where the two models differ most</strong>",
                                        "<strong>Residual over time</strong>",
                                        "<strong>Spectrum of the residual</strong>",
                                        "<h2>Noise budget: what the residual is made of</h2>",
                                        "<th>resonance</th><th>noise</th><th>unexplained</th><th>total</th>",
                                        "<h2>The chain</h2>",
                                        "<h2>What was found</h2>",
                                        "<dd>frequency 1",
                                        "<details>\n<summary>What else was considered</summary>",
                                        "<details>\n<summary>What would have been seen, and what was not testable<",
                                        "<details>\n<summary>What was not looked for</summary>",
                                        "</details>",
                                        "<dt>Made</dt>"};
    set_unseen();
    work_out();
    char *html = page();
    const char *at = html;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        at = strstr(at, parts[i]);
        TEST_ASSERT_NOT_NULL_MESSAGE(at, parts[i]);
    }
    TEST_ASSERT_NOT_NULL(strstr(html, "<polyline class=\"before dashed\"")); /* beside the other one, not below it */
    free(html);
    account_free(&account);
}

/* What only comes near is not sold as found, and there is nothing to tell it from. */
static void test_what_comes_near_is_not_found(void) {
    finding_t *finding = &diagnosis.finding[0];
    const char *const near[] = {"mechanics, comes nearest, does not explain it</small>", "<h2>What comes nearest</h2>",
                                "<dt>To see more of it, record</dt>"};
    TEST_ASSERT_EQUAL_STRING("found", finding_standing(&diagnosis, finding));
    TEST_ASSERT_EQUAL_STRING("Shows best in", excitation_heading(finding));
    finding->certainty = ISOLATED;
    finding->rivals = 1;
    finding->rival[0] = &block_sensor_bandwidth;
    TEST_ASSERT_EQUAL_STRING("found; or a block it is confused with", finding_standing(&diagnosis, finding));
    TEST_ASSERT_EQUAL_STRING("To tell them apart, record", excitation_heading(finding));
    finding->certainty = DETECTED;
    diagnosis.verdict = UNKNOWN_PHYSICS;
    TEST_ASSERT_EQUAL_STRING("comes nearest, does not explain it", finding_standing(&diagnosis, finding));
    finding->rivals = 0;
    work_out();
    expect_all(page(), near, 3);
    account_free(&account);
}

/* What was taken stands first in its round; what explained more by itself says why it was not. */
static void test_what_was_taken_stands_first(void) {
    size_t order[DIAGNOSIS_MOST_CONSIDERED];
    diagnosis.rounds = 2;
    diagnosis.considered = 4;
    diagnosis.consideration[0] =
        (considered_t){.block = &block_creep, .round = 1, .likelihood = 28886.0, .outcome = LESS_LIKELY};
    diagnosis.consideration[1] =
        (considered_t){.block = &block_resonance, .round = 1, .likelihood = 26302.0, .outcome = TAKEN};
    diagnosis.consideration[2] =
        (considered_t){.block = &block_gain_drift, .round = 1, .likelihood = 100.0, .outcome = LESS_LIKELY};
    diagnosis.consideration[3] =
        (considered_t){.block = &block_gain_drift, .round = 2, .likelihood = 10.0, .outcome = NOT_SIGNIFICANT};
    TEST_ASSERT_EQUAL_UINT64(4, considered_in_order(&diagnosis, order));
    const size_t expected[] = {1, 0, 2, 3};
    TEST_ASSERT_EQUAL_MEMORY(expected, order, sizeof expected);
    TEST_ASSERT_NOT_NULL(strstr(outcome_text(&diagnosis, 0), "explains more alone, but less when"));
    TEST_ASSERT_EQUAL_STRING("explains less than the best", outcome_text(&diagnosis, 2));
}

/* No network, no script but the page's, nothing of a recording's header or name unescaped, no number that is none;
 * twice the same. */
static void test_page_stands_alone_and_is_repeatable(void) {
    set_unseen();
    work_out();
    TEST_ASSERT_EQUAL_INT(0, setenv("SOURCE_DATE_EPOCH", "1700000000", 1)); /* a page says the second it was made in */
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, NULL, "one.html", &failure));
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, NULL, "two.html", &failure));
    TEST_ASSERT_EQUAL_INT(0, unsetenv("SOURCE_DATE_EPOCH"));
    char *one = contents("one.html"), *two = contents("two.html");
    const char *const none[] = {"<script>", "http", "src=", "url(", "<b>&", "\"steps\"", " nan",
                                ",nan",     ">nan", " inf", ",inf", ">inf", "-inf"};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        TEST_ASSERT_NULL_MESSAGE(strstr(one, none[i]), none[i]);
    }
    const char *const some[] = {"<b>resonance</b>", "box found", "Loop", "Spectrum of the residual", "Held-out error"};
    for (size_t i = 0; i < sizeof some / sizeof some[0]; i++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(one, some[i]), some[i]);
    }
    TEST_ASSERT_EQUAL_STRING(one, two);
    size_t scripts = 0, pictures = 0;
    for (const char *at = one; (at = strstr(at, "<script")) != NULL; at++) {
        scripts++;
    }
    for (const char *at = one; (at = strstr(at, "<figure>")) != NULL; at++) {
        pictures++;
    }
    TEST_ASSERT_EQUAL_UINT64(pictures + 1, scripts); /* the data of each, and the one that shows them */
    free(one);
    free(two);
    account_free(&account);
}

/* Whether the page has a bar of this name and error that is the last one. */
static bool last_bar_is(const char *what, const char *percent) {
    char row[160];
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, NULL, "bars.html", &failure));
    char *page = contents("bars.html");
    snprintf(row, sizeof row, "<td>%s</td><td>%s</td><td class=\"bars\"><span class=\"bar last\"", what, percent);
    const bool there = strstr(page, row) != NULL;
    free(page);
    return there;
}

/* When what was found is fitted once more, the chain's error is no longer that of the last step. */
static void test_bars_end_at_the_error_of_the_chain(void) {
    work_out();
    TEST_ASSERT_TRUE(last_bar_is("+&nbsp;resonance", "0.1000"));
    diagnosis.held_out_percent = 0.0942;
    TEST_ASSERT_TRUE(last_bar_is("all, fitted together", "0.0942"));
    TEST_ASSERT_FALSE(last_bar_is("+&nbsp;resonance", "0.1000"));
    account_free(&account);
}

/* The block ends at 1000 s; the recordings end before, and show nothing quicker than two samples. */
static void test_a_creep_says_over_what_times_it_is_valid(void) {
    const double longest_s = SAMPLES / recordings[0].sample_rate_hz, begins_s = 0.25 * longest_s;
    char text[DIAGNOSIS_LINE];
    double time_s[2];
    work_out();
    TEST_ASSERT_FALSE(finding_times_text(&diagnosis, &diagnosis.finding[0], text)); /* a mode is no relaxation */
    model_block_t *creep = model_append(&diagnosis.model, &block_creep);
    const finding_t finding = {.block = &block_creep};
    model_set(creep, "shortest_s", begins_s);
    TEST_ASSERT_TRUE(finding_times(&diagnosis, &finding, time_s));
    TEST_ASSERT_EQUAL_DOUBLE(begins_s, time_s[0]);
    TEST_ASSERT_EQUAL_DOUBLE(longest_s, time_s[1]);
    TEST_ASSERT_TRUE(finding_times_text(&diagnosis, &finding, text));
    TEST_ASSERT_NOT_NULL(strstr(text, "these recordings do not show"));
    model_set(creep, "shortest_s", 2.0 * longest_s); /* it has not begun */
    TEST_ASSERT_FALSE(finding_times(&diagnosis, &finding, time_s));
    account_free(&account);
}

int main(void) {
    rng = random_start("diagnose_words", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_a_creep_says_over_what_times_it_is_valid);
    RUN_TEST(test_what_is_isolated_is_not_sold_as_a_name);
    RUN_TEST(test_what_was_not_found_tells_its_smallest_size);
    RUN_TEST(test_only_a_given_model_came_in);
    RUN_TEST(test_what_was_changed_in_a_given_chain_is_told);
    RUN_TEST(test_what_remains_is_told_in_words);
    RUN_TEST(test_an_unknown_past_is_told);
    RUN_TEST(test_the_better_model_is_named_where_it_was_written);
    RUN_TEST(test_nothing_found);
    RUN_TEST(test_page_has_its_order);
    RUN_TEST(test_what_comes_near_is_not_found);
    RUN_TEST(test_what_was_taken_stands_first);
    RUN_TEST(test_page_stands_alone_and_is_repeatable);
    RUN_TEST(test_bars_end_at_the_error_of_the_chain);
    return UNITY_END();
}
