/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a diagnosis is told as: JSON against its format, text, page and model, from a search whose result is given. */
#include "catalogue.h"
#include "diagnosis/diagnosis_json.h"
#include "diagnosis/diagnosis_report.h"
#include "diagnosis/diagnosis_text.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SAMPLES = 6000, RECORDINGS = 2 };
static const double rate_hz = 2000.0, noise_um = 0.003;
static random_t rng;
static recording_t recordings[RECORDINGS];
static diagnosis_t diagnosis;
static account_t account;
static failure_t failure;

/* Triangles of 0.2 s; the second recording half as high and in steps that are held. */
static void fill_drive(void) {
    const double corner[] = {0.0, 100.0, 20.0, 80.0, 0.0, 60.0};
    for (size_t i = 0; i < RECORDINGS; i++) {
        double *drive = recordings[i].column[COLUMN_DRIVE];
        fill_lines(drive, SAMPLES, corner, 6, 200);
        for (size_t k = 0; i == 1 && k < SAMPLES; k++) {
            drive[k] = 0.5 * corner[k / 200 % 6];
        }
    }
}

static void add_resonance(model_t *model, double frequency_hz, double damping_ratio) {
    model_block_t *block = model_append(model, &block_resonance);
    model_set(block, "frequency_hz", frequency_hz);
    model_set(block, "damping_ratio", damping_ratio);
}

/* As the search would leave it: a chain with the true block, and its true numbers. */
void setUp(void) {
    const double weights[] = {0.1, 0.03, 0.02, 0.01}, thresholds[] = {5.0, 15.0, 30.0};
    const char *names[RECORDINGS] = {"triangles.csv", "a<b>&\"steps\".csv"};
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_create(&recordings[i], names[i], rate_hz, SAMPLES);
        recording_set_key(&recordings[i], "actuator", "<script>");
    }
    fill_drive();
    memset(&diagnosis, 0, sizeof diagnosis);
    make_bank_model(&diagnosis.baseline, rate_hz, 1.0, 3, weights, thresholds);
    model_copy(&diagnosis.given, &diagnosis.baseline);
    model_copy(&diagnosis.model, &diagnosis.baseline);
    add_resonance(&diagnosis.model, 180.0, 0.05);
    for (size_t i = 0; i < RECORDINGS; i++) {
        simulate_into(&recordings[i], &diagnosis.model, 1);
        for (size_t k = 0; k < SAMPLES; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] += noise_um * random_normal(&rng);
        }
    }
    TEST_ASSERT_TRUE(samples_open(&diagnosis.samples, &diagnosis.baseline, recordings, RECORDINGS, &failure));
    diagnosis.noise = (noise_t){.sigma_um = noise_um, .rms_um = noise_um, .at_rest = true};
    diagnosis.given_nrmse_percent = 1.9;
    diagnosis.given_held_out_percent = 2.0;
    diagnosis.baseline_nrmse_percent = 0.9;
    diagnosis.baseline_held_out_percent = 1.0;
    diagnosis.nrmse_percent = diagnosis.held_out_percent = 0.1;
    diagnosis.noise_percent = 0.1;
    diagnosis.verdict = EXPLAINED;
    diagnosis.findings = 1;
    diagnosis.finding[0] = (finding_t){.block = &block_resonance,
                                       .certainty = NAMED,
                                       .t = 100.0,
                                       .t_blocks = 50.0,
                                       .margin = 40.0,
                                       .support = 60.0,
                                       .held_out_before_percent = 1.0,
                                       .held_out_after_percent = 0.1};
    diagnosis.rounds = diagnosis.considered = 1;
    diagnosis.consideration[0] = (considered_t){.block = &block_resonance, .round = 1, .outcome = TAKEN};
}

void tearDown(void) {
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_free(&recordings[i]);
    }
    diagnosis_free(&diagnosis);
}

/* As the command does it when the search is over. */
static void work_out(void) {
    TEST_ASSERT_TRUE_MESSAGE(findings_errors(&diagnosis, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(account_for(&diagnosis, recordings, RECORDINGS, &account, &failure), failure.text);
}

static json_t *as_json(void) {
    json_t *json = diagnosis_to_json(&diagnosis, &account, recordings, RECORDINGS);
    TEST_ASSERT_NOT_NULL(json);
    return json;
}

/* Every key with its type, and no other: "{s:s}" as for json_unpack; ! refuses further keys. */
static void expect_format(json_t *json, const char *format, ...) {
    va_list arguments;
    json_error_t error;
    va_start(arguments, format);
    const int status = json_vunpack_ex(json, &error, JSON_STRICT, format, arguments);
    va_end(arguments);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, status, error.text);
}

static void expect_ranges(const json_t *ranges, size_t least) {
    TEST_ASSERT_TRUE(json_is_array(ranges) && json_array_size(ranges) >= least);
    double last = -HUGE_VAL;
    for (size_t i = 0; i < json_array_size(ranges); i++) {
        const json_t *pair = json_array_get(ranges, i);
        TEST_ASSERT_EQUAL_UINT64(2, json_array_size(pair));
        const double from = json_number_value(json_array_get(pair, 0)), to = json_number_value(json_array_get(pair, 1));
        TEST_ASSERT_TRUE(from >= last && to > from);
        last = to;
    }
}

static void test_json_has_the_format_of_the_contract(void) {
    work_out();
    json_t *json = as_json(), *names, *chain, *findings, *where, *parameters, *confusable, *remaining, *unseen, *band;
    double given, before, held_out, nrmse, floor_percent, confidence, value, sigma, rms;
    const char *text, *place, *certainty, *unit, *explanation, *excitation, *loop, *name;
    int structured, outliers;
    expect_format(json,
                  "{s:s, s:o, s:{s:f, s:f}, s:{s:o, s:f, s:f}, s:o, s:o, s:{s:f, s:f, s:f, s:b, s:f, s:o, s:i, s:o}, "
                  "s:s}",
                  "format", &text, "recordings", &names, "given", "nrmse_percent", &given, "held_out_nrmse_percent",
                  &held_out, "baseline", "chain", &chain, "nrmse_percent", &before, "held_out_nrmse_percent", &held_out,
                  "findings", &findings, "not_found", &unseen, "remaining", "nrmse_percent", &nrmse,
                  "held_out_nrmse_percent", &held_out, "noise_floor_percent", &floor_percent, "structured", &structured,
                  "rms_um", &rms, "band_hz", &band, "outliers", &outliers, "where", &remaining, "verdict", &place);
    TEST_ASSERT_EQUAL_DOUBLE(1.9, given);
    TEST_ASSERT_EQUAL_DOUBLE(0.9, before);
    TEST_ASSERT_TRUE(json_is_null(band));
    TEST_ASSERT_EQUAL_STRING("hyst-diagnosis-1", text);
    TEST_ASSERT_EQUAL_STRING("explained", place);
    TEST_ASSERT_EQUAL_UINT64(2, json_array_size(names));
    TEST_ASSERT_EQUAL_UINT64(1, json_array_size(chain)); /* the baseline's, without what was found */
    TEST_ASSERT_FALSE(structured);
    TEST_ASSERT_EQUAL_UINT64(0, json_array_size(json_object_get(remaining, "time_s")));
    expect_format(json_array_get(findings, 0), "{s:s, s:s, s:s, s:f, s:o, s:f, s:f, s:o, s:s, s:o, s:s}", "block",
                  &text, "place", &place, "certainty", &certainty, "confidence", &confidence, "parameters", &parameters,
                  "held_out_nrmse_percent_before", &before, "held_out_nrmse_percent_after", &nrmse, "where", &where,
                  "explanation", &explanation, "confusable_with", &confusable, "separating_excitation", &excitation);
    TEST_ASSERT_EQUAL_STRING("resonance", text);
    TEST_ASSERT_EQUAL_STRING("mechanics", place);
    TEST_ASSERT_EQUAL_STRING("named", certainty);
    TEST_ASSERT_TRUE(confidence > 0.9 && confidence < 1.0);
    TEST_ASSERT_EQUAL_UINT64(0, json_array_size(confusable));
    expect_format(parameters, "{s:{s:f, s:f, s:s}, s:{s:f, s:f, s:s}}", "frequency_hz", "value", &value, "sigma",
                  &sigma, "unit", &unit, "damping_ratio", "value", &value, "sigma", &sigma, "unit", &unit);
    expect_ranges(json_object_get(where, "time_s"), 1);
    expect_ranges(json_object_get(where, "frequency_hz"), 1);
    expect_ranges(json_object_get(where, "drive"), 1);
    expect_format(json_object_get(where, "loop"), "s", &loop);
    expect_format(json_object_get(where, "recording"), "s", &name);
    TEST_ASSERT_EQUAL_STRING(recordings[1].name, name); /* steps ring more than triangles */
    json_decref(json);
    account_free(&account);
}

/* The mode is where the simulations with and without it differ, though the hysteresis is fitted again. */
static void test_a_mode_is_located_at_its_frequency(void) {
    work_out();
    const ranges_t *hz = &account.where[0].frequency_hz;
    bool met = false;
    for (size_t i = 0; i < hz->count; i++) {
        met = met || (hz->range[i].from < 180.0 && hz->range[i].to > 180.0);
    }
    TEST_ASSERT_TRUE(met);
    TEST_ASSERT_TRUE(account.where[0].somewhere);
    TEST_ASSERT_TRUE(account.where[0].fundamental_hz > 0.0); /* both drives repeat themselves */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, rate_hz / 1200.0, account.where[0].fundamental_hz);
    account_free(&account);
}

/* White noise of known size: the standard error of the frequency follows from the derivative of the simulation. It is
 * larger by sqrt(3/2) = 1.22 for the held-out third, by what the other numbers share with it (about 1 %), and by the
 * scatter of the autocorrelation time, which is 1 or more for white residuals. What the block's approximations add is
 * told by its table, and is more. */
static void test_standard_errors_are_those_of_the_noise(void) {
    work_out();
    const model_block_t *block = model_find(&diagnosis.model, "resonance");
    const double told = model_parameter(block, "frequency_hz")->sigma[0], step = 0.01;
    const double sigma = sqrt(told * told - pow(block_resonance.probe->accuracy * 180.0, 2.0));
    double squares = 0.0;
    for (size_t i = 0; i < RECORDINGS; i++) {
        static double low[SAMPLES], high[SAMPLES];
        model_t shifted;
        model_copy(&shifted, &diagnosis.model);
        model_set(&shifted.block[1], "frequency_hz", 180.0 - step);
        TEST_ASSERT_TRUE(chain_simulate(&shifted, &recordings[i], 0, low, &failure));
        model_set(&shifted.block[1], "frequency_hz", 180.0 + step);
        TEST_ASSERT_TRUE(chain_simulate(&shifted, &recordings[i], 0, high, &failure));
        for (size_t k = account.from[i]; k < SAMPLES; k++) {
            squares += pow((high[k] - low[k]) / (2.0 * step), 2.0);
        }
        model_free(&shifted);
    }
    const double alone = noise_um / sqrt(squares);
    printf("sigma of the frequency %.5f Hz, alone %.5f Hz\n", sigma, alone);
    TEST_ASSERT_TRUE(sigma > 1.2 * alone && sigma < 1.5 * alone);
    TEST_ASSERT_NOT_NULL(model_parameter(&diagnosis.model.block[0], "weights")->sigma);
    account_free(&account);
}

/* What compile and simulate need of it is there: it is read back, with the ranges of these recordings. */
static void test_the_augmented_model_is_complete(void) {
    double range[2];
    model_t read;
    work_out();
    TEST_ASSERT_TRUE_MESSAGE(model_write(&diagnosis.model, "augmented.json", &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(model_read(&read, "augmented.json", &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(2, read.blocks);
    TEST_ASSERT_TRUE(model_fit_range(&read, "drive_range_v", range));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, range[0]);
    TEST_ASSERT_EQUAL_DOUBLE(100.0, range[1]);
    TEST_ASSERT_TRUE(model_fit_range(&read, "displacement_range_um", range));
    TEST_ASSERT_EQUAL_DOUBLE(0.1, json_number_value(json_object_get(read.fit, "held_out_nrmse_percent")));
    model_free(&read);
    account_free(&account);
}

/* What the baseline covers stays covered; the converters are those of the recordings, if they agree, else its own. */
static void test_the_augmented_model_keeps_what_is_known(void) {
    double range[2];
    diagnosis.model.fit = json_pack("{s:[ff], s:[ff], s:[ff]}", "drive_range_v", -20.0, 60.0, "drive_converter_v", -9.0,
                                    9.0, "position_converter_um", -1.0, 20.0);
    recording_set_key(&recordings[1], "drive_converter_v", "-25.5:130");
    work_out();
    TEST_ASSERT_TRUE(model_fit_range(&diagnosis.model, "drive_range_v", range));
    TEST_ASSERT_EQUAL_DOUBLE(-20.0, range[0]);
    TEST_ASSERT_EQUAL_DOUBLE(100.0, range[1]);
    TEST_ASSERT_TRUE(model_fit_range(&diagnosis.model, "drive_converter_v", range));
    TEST_ASSERT_EQUAL_DOUBLE(-25.5, range[0]);
    TEST_ASSERT_EQUAL_DOUBLE(130.0, range[1]);
    TEST_ASSERT_TRUE(model_fit_range(&diagnosis.model, "position_converter_um", range));
    TEST_ASSERT_EQUAL_DOUBLE(20.0, range[1]);
    account_free(&account);
    recording_set_key(&recordings[0], "drive_converter_v", "-25.5:131");
    work_out();
    TEST_ASSERT_FALSE(model_fit_range(&diagnosis.model, "drive_converter_v", range));
    account_free(&account);
}

static void test_what_is_isolated_is_not_sold_as_a_name(void) {
    char text[DIAGNOSIS_LINE];
    finding_t *finding = &diagnosis.finding[0];
    finding->certainty = ISOLATED;
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
    TEST_ASSERT_EQUAL_STRING("cannot be told from the best", outcome_text(&diagnosis, 1));
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

static void test_confidence_rises_with_margin_and_support(void) {
    finding_t finding = {.block = &block_creep, .certainty = NAMED, .margin = 20.0, .support = 200.0};
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.9, finding_confidence(&finding)); /* as the header says */
    finding.support = 12.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.9 * 0.909, finding_confidence(&finding));
    finding.margin = 0.0;
    finding.support = 1e6;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, finding_confidence(&finding));
    finding.margin = HUGE_VAL;
    TEST_ASSERT_EQUAL_DOUBLE(0.99, finding_confidence(&finding)); /* never certain */
    finding.support = -5.0;
    TEST_ASSERT_EQUAL_DOUBLE(0.0, finding_confidence(&finding));
    double last = 0.0;
    for (int margin = 0; margin < 100; margin++) {
        finding = (finding_t){.block = &block_creep, .certainty = NAMED, .margin = margin, .support = 50.0};
        const double confidence = finding_confidence(&finding);
        TEST_ASSERT_TRUE(confidence >= last && confidence < 1.0);
        last = confidence;
    }
}

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
    TEST_ASSERT_EQUAL_INT(0, fflush(stdout));
    const int kept = dup(STDOUT_FILENO);
    FILE *file = fopen("printed.txt", "w");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_INT(STDOUT_FILENO, dup2(fileno(file), STDOUT_FILENO));
    diagnosis_print(&diagnosis, &account, recordings, RECORDINGS);
    TEST_ASSERT_EQUAL_INT(0, fflush(stdout));
    TEST_ASSERT_EQUAL_INT(STDOUT_FILENO, dup2(kept, STDOUT_FILENO));
    close(kept);
    fclose(file);
    return contents("printed.txt");
}

static char *page(void) {
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, "page.html", &failure));
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
        {.block = &block_thermal_drift, .testable = false, .smallest_um = HUGE_VAL, .value = 1.0},
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

static void test_what_was_not_found_tells_its_smallest_size(void) {
    const char *const told[] = {
        "\nnot seen, beside what was found\n   transport_delay            would have been seen from 0.031 um rms "
        "(delay_s = 0.00025 s)\n   creep                      would have been seen from 0.0021 um rms "
        "(gamma_per_decade "
        "= 0.00041)\n   static_nonlinearity        would have been seen from 0.5 um rms\n   thermal_drift              "
        "not testable here: other numbers imitate it\n\nnext       hyst record --port DEV --probe resonance\n",
        ": hyst record --port DEV --probe resonance\n   "};
    const char *const shown[] = {"<td>creep</td><td>0.0021&nbsp;µm rms (gamma_per_decade = 0.00041)</td>",
                                 "<td>thermal_drift</td><td>not testable here",
                                 ": <code>hyst record --port DEV --probe resonance</code></dd>"};
    const char *name, *excitation, *probe, *parameter, *unit;
    double smallest, value;
    int testable;
    set_unseen();
    work_out();
    json_t *json = as_json(), *list = json_object_get(json, "not_found");
    TEST_ASSERT_EQUAL_UINT64(4, json_array_size(list));
    expect_format(json_array_get(list, 1), "{s:s, s:b, s:f, s:{s:s, s:f, s:s}, s:s, s:s}", "block", &name, "testable",
                  &testable, "smallest_um", &smallest, "parameter", "name", &parameter, "value", &value, "unit", &unit,
                  "separating_excitation", &excitation, "probe", &probe);
    TEST_ASSERT_EQUAL_STRING("creep", name);
    TEST_ASSERT_EQUAL_STRING("gamma_per_decade", parameter);
    TEST_ASSERT_EQUAL_STRING("hyst record --probe creep", probe);
    TEST_ASSERT_TRUE(testable && smallest == 0.00212 && value == 0.00041);
    expect_format(json_array_get(list, 2), "{s:s, s:b, s:f, s:n, s:s, s:s}", "block", &name, "testable", &testable,
                  "smallest_um", &smallest, "parameter", "separating_excitation", &excitation, "probe", &probe);
    TEST_ASSERT_EQUAL_STRING("static_nonlinearity", name);
    expect_format(json_array_get(list, 3), "{s:s, s:b, s:n, s:n, s:s, s:s}", "block", &name, "testable", &testable,
                  "smallest_um", "parameter", "separating_excitation", &excitation, "probe", &probe);
    TEST_ASSERT_EQUAL_STRING("thermal_drift", name);
    TEST_ASSERT_FALSE(testable);
    expect_all(printed(), told, 2);
    expect_all(page(), shown, 3);
    diagnosis.finding[0].certainty = NAMED;
    TEST_ASSERT_EQUAL_STRING("all", next_probe(&diagnosis));
    json_decref(json);
    account_free(&account);
}

/* A model that was given is told apart from what its own hysteresis, fitted again, makes of it. */
static void test_only_a_given_model_came_in(void) {
    const char *const told[] = {"NRMSE 1.9000 % -> 0.9000 % -> 0.1000 %, held out 2.0000 % -> 1.0000 % -> 0.1000 %",
                                "(the chain as it came in -> its hysteresis fitted again -> with what was found)"};
    const char *const shown[] = {"as it came in</td><td>2.0000", "hysteresis fitted again</td><td>1.0000",
                                 "1.9000&nbsp;% as it came in, 0.9000&nbsp;% before"};
    const char *const begun[] = {"NRMSE 0.9000 % -> 0.1000 %, held out 1.0000 % -> 0.1000 %; noise"};
    work_out();
    expect_all(printed(), told, 2);
    expect_all(page(), shown, 3);
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

static void expect_remainder(remainder_t remainder, const char *expected) {
    char text[DIAGNOSIS_LINE];
    diagnosis.remainder = remainder;
    remainder_text(&diagnosis, text);
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_what_remains_is_told_in_words(void) {
    const char
        *const told[] = {"\nremaining  0.012 um rms beside the noise, most of it at 2 .. 2.83 Hz; 5 single samples "},
               *const shown[] = {"<p>The model leaves 0.012&nbsp;µm rms beside the noise, most of it at 2–2.83 Hz; 5"};
    double low, high;
    expect_remainder((remainder_t){0}, "noise at all frequencies");
    expect_remainder((remainder_t){.outliers = 1},
                     "noise at all frequencies; 1 single sample far outside the noise: too little to ask for a reason");
    expect_remainder((remainder_t){.rms_um = 0.0004, .low_hz = 10.0, .high_hz = 14.1},
                     "0.0004 um rms beside the noise, most of it at 10 .. 14.1 Hz: too little to ask for a reason");
    expect_remainder((remainder_t){.outliers = 9, .structured = true},
                     "noise at all frequencies; 9 single samples far outside the noise");
    diagnosis.remainder =
        (remainder_t){.rms_um = 0.012, .low_hz = 2.0, .high_hz = 2.83, .outliers = 5, .structured = true};
    work_out();
    json_t *json = as_json(), *remaining = json_object_get(json, "remaining");
    expect_format(json_object_get(remaining, "band_hz"), "[f, f]", &low, &high);
    TEST_ASSERT_TRUE(low == 2.0 && high == 2.83);
    TEST_ASSERT_EQUAL_INT(5, json_integer_value(json_object_get(remaining, "outliers")));
    TEST_ASSERT_EQUAL_DOUBLE(0.012, json_number_value(json_object_get(remaining, "rms_um")));
    TEST_ASSERT_TRUE(json_is_true(json_object_get(remaining, "structured")));
    expect_all(printed(), told, 1);
    expect_all(page(), shown, 1);
    json_decref(json);
    account_free(&account);
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
    TEST_ASSERT_NULL(strstr(shown, "<polyline class=\"before\"")); /* there is only one model to show */
    TEST_ASSERT_NOT_NULL(strstr(shown, "<polyline class=\"after\""));
    free(shown);
    json_decref(json);
    account_free(&account);
}

/* No network, no script, nothing of a recording's header or name unescaped, no number that is none; twice the same. */
static void test_page_stands_alone_and_is_repeatable(void) {
    set_unseen();
    work_out();
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, "one.html", &failure));
    TEST_ASSERT_TRUE(diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, "two.html", &failure));
    char *one = contents("one.html"), *two = contents("two.html");
    const char *const none[] = {"<script", "http", "src=", "url(", "<b>&", "\"steps\"", " nan",
                                ",nan",    ">nan", " inf", ",inf", ">inf", "-inf"};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        TEST_ASSERT_NULL_MESSAGE(strstr(one, none[i]), none[i]);
    }
    const char *const some[] = {"<b>resonance</b>", "box found", "Loop", "Spectrum of the residual", "Held-out error"};
    for (size_t i = 0; i < sizeof some / sizeof some[0]; i++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(one, some[i]), some[i]);
    }
    TEST_ASSERT_EQUAL_STRING(one, two);
    free(one);
    free(two);
    account_free(&account);
}

static void test_what_cannot_be_written_is_one_line(void) {
    work_out();
    TEST_ASSERT_FALSE(
        diagnosis_write_report(&diagnosis, &account, recordings, RECORDINGS, "no/such/folder.html", &failure));
    expect_line(&failure, "no/such/folder.html");
    TEST_ASSERT_FALSE(
        diagnosis_write_json(&diagnosis, &account, recordings, RECORDINGS, "no/such/folder.json", &failure));
    expect_line(&failure, "no/such/folder.json");
    account_free(&account);
}

int main(void) {
    rng = random_start("diagnose_output", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_json_has_the_format_of_the_contract);
    RUN_TEST(test_a_mode_is_located_at_its_frequency);
    RUN_TEST(test_standard_errors_are_those_of_the_noise);
    RUN_TEST(test_the_augmented_model_is_complete);
    RUN_TEST(test_the_augmented_model_keeps_what_is_known);
    RUN_TEST(test_what_is_isolated_is_not_sold_as_a_name);
    RUN_TEST(test_confidence_rises_with_margin_and_support);
    RUN_TEST(test_what_was_not_found_tells_its_smallest_size);
    RUN_TEST(test_only_a_given_model_came_in);
    RUN_TEST(test_what_remains_is_told_in_words);
    RUN_TEST(test_nothing_found);
    RUN_TEST(test_page_stands_alone_and_is_repeatable);
    RUN_TEST(test_what_cannot_be_written_is_one_line);
    return UNITY_END();
}
