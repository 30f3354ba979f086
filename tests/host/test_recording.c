/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Recordings: what is read, what is written, and that every kind of broken file is refused with one line naming file
 * and line. */
#include "recording/recording.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const char file[] = "test_recording.csv";

void setUp(void) {
}
void tearDown(void) {
    remove(file);
}

#define HEADER "# sample_rate_hz: 100\n# drive_unit: V\n# displacement_unit: um\n"
#define NAMES  HEADER "t,drive,displacement\n"

static void test_reads_columns_in_any_order_and_keeps_keys(void) {
    static const char text[] = "# sample_rate_hz: 100\r\n# actuator: P-885: two colons\n# a remark\n"
                               "temperature , displacement,other,t,drive\n"
                               "20.5,1.5,text,5.00,-1e1\n21,  2.5,,5.01,10\n22,3.5,x,5.02,+.5";
    recording_t recording;
    failure_t failure;
    write_file(file, text, strlen(text));
    TEST_ASSERT_TRUE_MESSAGE(recording_read(&recording, file, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(3, recording.samples);
    TEST_ASSERT_EQUAL_DOUBLE(100.0, recording.sample_rate_hz);
    TEST_ASSERT_EQUAL_DOUBLE(5.0, recording.start_s);
    TEST_ASSERT_EQUAL_DOUBLE(-10.0, recording.column[COLUMN_DRIVE][0]);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, recording.column[COLUMN_DRIVE][2]);
    TEST_ASSERT_EQUAL_DOUBLE(3.5, recording.column[COLUMN_DISPLACEMENT][2]);
    TEST_ASSERT_EQUAL_DOUBLE(21.0, recording.column[COLUMN_TEMPERATURE][1]);
    TEST_ASSERT_NULL(recording.column[COLUMN_REFERENCE]);
    TEST_ASSERT_EQUAL_STRING("P-885: two colons", recording_key(&recording, "actuator"));
    TEST_ASSERT_NULL(recording_key(&recording, "amplifier"));
    TEST_ASSERT_EQUAL(0, recording.extras); /* words */
    recording_free(&recording);
}

/* Columns without a meaning are written and read back, with what their names and units say; no name of another program
 * makes a line or a column of its own. */
static void test_keeps_further_columns(void) {
    static const double value[4] = {0.1, (double)NAN, -HUGE_VAL, 1e300};
    static const struct {
        const char *name, *long_name, *unit, *read_name, *read_long_name, *read_unit;
    } column[] = {{"p", "Chamber, \"raw\": 1", "mbar", "p", "Chamber, \"raw\": 1", "mbar"},
                  {"drive", "", "", "drive_2", "drive", ""},
                  {"t\n# preload_n: 5", "", "a\nb", "t_preload_n_5", "t # preload_n: 5", "a b"},
                  {"a,b,drive", "", "", "a_b_drive", "a,b,drive", ""}};
    enum { COLUMNS = sizeof column / sizeof column[0] };
    recording_t written, read;
    failure_t failure;
    recording_create(&written, "x", 100.0, 4);
    recording_set_key(&written, "note", "x\nt,drive");
    for (size_t i = 0; i < RECORDING_CSV_EXTRAS + 2; i++) {
        const bool named = i < COLUMNS;
        recording_add_extra(&written, named ? column[i].name : "further", named ? column[i].long_name : "",
                            named ? column[i].unit : "", value);
    }
    TEST_ASSERT_TRUE(recording_write(&written, file, &failure));
    TEST_ASSERT_TRUE_MESSAGE(recording_read(&read, file, &failure), failure.text);
    TEST_ASSERT_EQUAL(RECORDING_CSV_EXTRAS, read.extras);
    TEST_ASSERT_EQUAL_STRING("x t,drive", recording_key(&read, "note"));
    TEST_ASSERT_EQUAL(1, read.keys);
    for (size_t i = 0; i < COLUMNS; i++) {
        TEST_ASSERT_EQUAL_STRING(column[i].read_name, read.extra[i].name);
        TEST_ASSERT_EQUAL_STRING(column[i].read_long_name, read.extra[i].long_name);
        TEST_ASSERT_EQUAL_STRING(column[i].read_unit, read.extra[i].unit);
        TEST_ASSERT_TRUE(isnan(read.extra[i].value[1]));
        TEST_ASSERT_EQUAL_DOUBLE(value[0], read.extra[i].value[0]);
        TEST_ASSERT_TRUE(isinf(read.extra[i].value[2]) && read.extra[i].value[2] < 0.0);
        TEST_ASSERT_EQUAL_DOUBLE(value[3], read.extra[i].value[3]);
    }
    TEST_ASSERT_EQUAL(0, read.column[COLUMN_DRIVE][3]);
    recording_free(&written);
    recording_free(&read);
}

static void test_write_then_read_gives_the_same_numbers(void) {
    random_t random = {20250101};
    recording_t written, read;
    failure_t failure;
    recording_create(&written, "x", 12345.678, 5000);
    written.start_s = 3.25;
    recording_add_column(&written, COLUMN_CURRENT);
    for (size_t k = 0; k < written.samples; k++) {
        written.column[COLUMN_DRIVE][k] = 150.0 * random_normal(&random);
        written.column[COLUMN_DISPLACEMENT][k] =
            ldexp(random_normal(&random), (int)(k % 200) - 183); /* up to 2^16: plausible */
        written.column[COLUMN_CURRENT][k] = (double)k;
    }
    recording_set_key(&written, "actuator", "first");
    recording_set_key(&written, "actuator", "second");
    TEST_ASSERT_TRUE(recording_write(&written, file, &failure));
    TEST_ASSERT_TRUE_MESSAGE(recording_read(&read, file, &failure), failure.text);
    TEST_ASSERT_EQUAL_UINT64(written.samples, read.samples);
    TEST_ASSERT_TRUE(written.sample_rate_hz == read.sample_rate_hz);
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        TEST_ASSERT_EQUAL(written.column[c] != NULL, read.column[c] != NULL);
        if (read.column[c] != NULL) {
            TEST_ASSERT_EQUAL_MEMORY(written.column[c], read.column[c], read.samples * sizeof(double));
        }
    }
    TEST_ASSERT_EQUAL_STRING("second", recording_key(&read, "actuator"));
    recording_free(&written);
    recording_free(&read);
}

/* Units that a header states are converted, by this reader and by that of other files (no sample rate in the header).
 */
static void test_converts_stated_units(void) {
    static const char *const texts[] = {
        "# sample_rate_hz: 100\n# drive_unit: mV\n# displacement_unit: nm\n# reference_unit: mm\n# temperature_unit: "
        "degC\nt,drive,displacement,reference,temperature\n0,1500,250,0.125,20\n0.01,-250,500,0.25,21\n",
        "# drive_unit: mV\n# displacement_unit: nm\n# reference_unit: mm\n# temperature_unit: degC\n"
        "t,drive,displacement,reference,temperature\n0,1500,250,0.125,20\n0.01,-250,500,0.25,21\n"};
    for (size_t i = 0; i < 2; i++) {
        recording_t recording;
        failure_t failure;
        write_file(file, texts[i], strlen(texts[i]));
        TEST_ASSERT_TRUE_MESSAGE(recording_read(&recording, file, &failure), failure.text);
        /* Each is one product with a power of ten: two roundings. */
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1.5, recording.column[COLUMN_DRIVE][0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, -0.25, recording.column[COLUMN_DRIVE][1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.25, recording.column[COLUMN_DISPLACEMENT][0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 250.0, recording.column[COLUMN_REFERENCE][1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, 21.0, recording.column[COLUMN_TEMPERATURE][1]);
        TEST_ASSERT_NULL(recording_key(&recording, "displacement_unit"));
        recording_free(&recording);
    }
}

typedef struct {
    const char *text, *line;
} bad_t;

static const bad_t bad_recordings[] = {
    {"", "test_recording.csv: empty file"},
    {HEADER, ":3: the recording ends after 0 samples"},
    {NAMES, ":4: the recording ends after 0 samples"},
    {NAMES "0,1,2\n", ":5: the recording ends after 1 samples"},
    {"t,drive,displacement\n0,1,2\n0.01,1,2\n", "column 2 'drive', taken for drive, never changes"},
    {"# sample_rate_hz: fast\nt,drive,displacement\n", ":1: sample_rate_hz is not a positive number: 'fast'"},
    {"# sample_rate_hz: -5\nt,drive,displacement\n", ":1: sample_rate_hz is not a positive number"},
    {"# sample_rate_hz: 0\nt,drive,displacement\n", ":1: sample_rate_hz is not a positive number"},
    {"# sample_rate_hz: inf\nt,drive,displacement\n", ":1: sample_rate_hz is not a positive number"},
    {"# sample_rate_hz: 100\n# sample_rate_hz: 200\n", ":2: second sample_rate_hz"},
    {"# sample_rate_hz: 100\n# drive_unit: nm\n", ":2: drive_unit is 'nm': right is V, or a multiple of it"},
    {"# sample_rate_hz: 100\n# displacement_unit: bananas\n", ":2: displacement_unit is 'bananas': right is um"},
    {"# sample_rate_hz: 100\n# displacement_unit: m\nt,drive,displacement\n0,1,2\n0.01,2,3\n",
     ":4: column 'displacement': '2' is not plausible: more than 1e+06 um"},
    {"# sample_rate_hz: 100\n# displacment_unit: nm\nt,drive,displacement\n0,1,2\n0.01,2,3\n",
     ": displacment_unit is the unit of no column that is there"},
    {HEADER "# t_unit: ms\nt,drive,displacement\n0,1,2\n0.01,2,3\n", ": t_unit is the unit of no column that is there"},
    {HEADER "t,drive\n0,1\n0.01,1\n", ":4: missing column 'displacement'"},
    {HEADER "t,displacement\n", ":4: missing column 'drive'"},
    {HEADER "drive,displacement\n", ":4: missing column 't'"},
    {HEADER "t,drive,displacement,drive\n", ":4: column 'drive' appears twice"},
    {HEADER "0,1,2\n", ":4: a number where the column names should be"},
    {NAMES "0,1,2\n0.01,1,2\n0.03,1,2\n", ":7: gap: t goes from 0.01 s to 0.03 s"},
    {NAMES "0,1,2\n0.01,1,2\n0.01,1,2\n", ":7: duplicate or backward time"},
    {NAMES "0,1,2\n0.01,1,2\n0.00,1,2\n", ":7: duplicate or backward time"},
    {NAMES "0,1,2\n0.02,1,2\n0.04,1,2\n", ":6: wrong rate: the first samples are 0.02 s apart"},
    {NAMES "0,1,2\n0.01001,1,2\n0.02002,1,2\n0.0315,1,2\n0.0425,1,2\n0.0535,1,2\n",
     ":9: wrong rate or uneven sampling"},
    {NAMES "0,1,2\n0.01,abc,2\n", ":6: column 'drive': 'abc' is not a finite number"},
    {NAMES "0,1,2\n0.01,nan,2\n", ":6: column 'drive': 'nan' is not a finite number"},
    {NAMES "0,1,2\n0.01,1,-inf\n", ":6: column 'displacement': '-inf' is not a finite number"},
    {NAMES "0,1,2\n0.01,1,1e999\n", ":6: column 'displacement': '1e999' is not a finite number"},
    {NAMES "0,1,2\n0.01,0x10,2\n", ":6: column 'drive': '0x10' is not a finite number"},
    {NAMES "0,1,2\n0.01,1 2,2\n", ":6: column 'drive': '1 2' is not a finite number"},
    {NAMES "0,1,2\n0.01,,2\n", ":6: column 'drive': '' is not a finite number"},
    {NAMES "0,1,2\nx,1,2\n", ":6: column 't': 'x' is not a finite number"},
    {NAMES "0,1,2\n0.01,1\n", ":6: ragged line, expected 3 columns"},
    {NAMES "0,1,2\n0.01,1,2,3\n", ":6: ragged line, expected 3 columns"},
    {NAMES "0,1,2\n\n0.01,1,2\n", ":6: empty line"},
    {NAMES "0,1,2\n# late: header\n", ":6: header line after the column names"},
    {"\x7f"
     "ELF\x02\x01",
     ":1: binary data"},
    {NAMES "0,1,2\n0.01,\x01,2\n", ":6: binary data"},
};

static void test_refuses_broken_files(void) {
    for (size_t i = 0; i < sizeof bad_recordings / sizeof bad_recordings[0]; i++) {
        recording_t recording;
        failure_t failure = {{0}};
        write_file(file, bad_recordings[i].text, strlen(bad_recordings[i].text));
        TEST_ASSERT_FALSE_MESSAGE(recording_read(&recording, file, &failure), bad_recordings[i].line);
        expect_line(&failure, bad_recordings[i].line);
        expect_line(&failure, file);
    }
}

static void test_refuses_zero_bytes_and_long_lines(void) {
    recording_t recording;
    failure_t failure;
    static char text[2 * RECORDING_MAX_LINE];
    const size_t start = (size_t)snprintf(text, sizeof text, "%s0,1,", NAMES);
    memset(text + start, '0', sizeof text - start);
    write_file(file, text, sizeof text);
    TEST_ASSERT_FALSE(recording_read(&recording, file, &failure));
    expect_line(&failure, ":5: line is longer than 32000 characters");
    memset(text + start, 0, sizeof text - start);
    write_file(file, text, sizeof text);
    TEST_ASSERT_FALSE(recording_read(&recording, file, &failure));
    expect_line(&failure, ":5: binary data");
}

static void test_refuses_what_is_not_a_file(void) {
    recording_t recording;
    failure_t failure;
    TEST_ASSERT_FALSE(recording_read(&recording, "no_such_file.csv", &failure));
    expect_line(&failure, "no_such_file.csv: No such file");
    TEST_ASSERT_FALSE(recording_read(&recording, ".", &failure));
    expect_line(&failure, "directory");
}

/* Any damage to a good file is either refused with a line, or leaves numbers that are finite: nothing in between, and
 * no crash. */
static void test_random_damage_is_refused_or_harmless(void) {
    const uint64_t seed = 7;
    random_t random = {seed};
    char good[4000];
    size_t length = (size_t)snprintf(good, sizeof good, "%s", NAMES), refused = 0;
    for (int k = 0; k < 100; k++) {
        length += (size_t)snprintf(good + length, sizeof good - length, "%.2f,%d,%d\n", 0.01 * k, k, 2 * k);
    }
    for (int turn = 0; turn < 3000; turn++) {
        char text[sizeof good];
        recording_t recording;
        failure_t failure = {{0}};
        memcpy(text, good, length);
        for (int i = 0; i < 3; i++) {
            text[(size_t)(random_unit(&random) * (double)length)] = (char)(256.0 * random_unit(&random));
        }
        write_file(file, text, (size_t)((double)length * fmin(1.0, 0.5 + random_unit(&random))));
        if (!recording_read(&recording, file, &failure)) {
            TEST_ASSERT_NOT_NULL(strstr(failure.text, file));
            refused++;
            continue;
        }
        for (size_t k = 0; k < recording.samples; k++) {
            TEST_ASSERT_TRUE(isfinite(recording.column[COLUMN_DRIVE][k]));
        }
        recording_free(&recording);
    }
    printf("seed %llu: %zu of 3000 damaged files refused\n", (unsigned long long)seed, refused);
    TEST_ASSERT_GREATER_THAN_UINT64(1500, refused); /* the test would prove nothing if damage went unnoticed */
}

/* Every first and last sample: what stays, its times, and what is marked. */
static void test_a_span(void) {
    enum { SAMPLES = 20 };
    failure_t failure;
    for (int from = 0; from <= SAMPLES; from++) {
        for (int to = 0; to <= SAMPLES; to++) {
            recording_t recording;
            recording_create(&recording, "rec.csv", 10.0, SAMPLES);
            recording.start_s = 0.3;
            for (int k = 0; k < SAMPLES; k++) {
                recording.column[COLUMN_DRIVE][k] = k;
                recording.column[COLUMN_DISPLACEMENT][k] = 100 + k;
            }
            recording_mask(&recording, 7, 8);
            const bool good = recording_span(&recording, 0.3 + 0.1 * from, 0.3 + 0.1 * to, &failure);
            TEST_ASSERT_EQUAL(from < to, good);
            if (good) {
                TEST_ASSERT_EQUAL_UINT64(to - from, recording.samples);
                TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.3 + 0.1 * from, recording.start_s);
                for (int k = from; k < to; k++) {
                    TEST_ASSERT_EQUAL_DOUBLE(k, recording.column[COLUMN_DRIVE][k - from]);
                    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 100 + k, recording.column[COLUMN_DISPLACEMENT][k - from]);
                    TEST_ASSERT_EQUAL(k == 7, recording.masked[k - from] != 0);
                }
            } else {
                TEST_ASSERT_NOT_NULL(strstr(failure.text, "rec.csv: no sample from"));
                TEST_ASSERT_EQUAL_UINT64(SAMPLES, recording.samples);
            }
            recording_free(&recording);
        }
    }
}

static void test_a_span_without_samples_is_named_as_it_was_given(void) {
    const double nan = (double)NAN, inf = (double)INFINITY;
    const struct {
        double from_s, to_s;
        const char *text;
    } cases[] = {{nan, 1.0, "the beginning of a span is not a number"},
                 {0.5, nan, "the end of a span is not a number"},
                 {-inf, -5.0, "no sample before -5 s"},
                 {9.0, inf, "no sample from 9 s on"},
                 {1.0, 0.5, "no sample from 1 to 0.5 s"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        failure_t failure;
        recording_t recording;
        recording_create(&recording, "rec.csv", 10.0, 20);
        TEST_ASSERT_FALSE(recording_span(&recording, cases[i].from_s, cases[i].to_s, &failure));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, cases[i].text), failure.text);
        recording_free(&recording);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_reads_columns_in_any_order_and_keeps_keys);
    RUN_TEST(test_keeps_further_columns);
    RUN_TEST(test_write_then_read_gives_the_same_numbers);
    RUN_TEST(test_converts_stated_units);
    RUN_TEST(test_refuses_broken_files);
    RUN_TEST(test_refuses_zero_bytes_and_long_lines);
    RUN_TEST(test_refuses_what_is_not_a_file);
    RUN_TEST(test_random_damage_is_refused_or_harmless);
    RUN_TEST(test_a_span);
    RUN_TEST(test_a_span_without_samples_is_named_as_it_was_given);
    return UNITY_END();
}
