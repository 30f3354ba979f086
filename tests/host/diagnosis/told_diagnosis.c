/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "told_diagnosis.h"
#include "diagnosis/answer/state.h"
#include "unity.h"

random_t rng;
recording_t recordings[RECORDINGS];
question_t *question;
answer_t diagnosis;
account_t account;
failure_t failure;

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

void setUp(void) {
    const double weights[] = {0.1, 0.03, 0.02, 0.01}, thresholds[] = {5.0, 15.0, 30.0};
    const char *names[RECORDINGS] = {"triangles.csv", "a<b>&\"steps\".csv"};
    for (size_t i = 0; i < RECORDINGS; i++) {
        recording_create(&recordings[i], names[i], RATE_HZ, SAMPLES);
        recording_set_key(&recordings[i], "actuator", "<script>");
    }
    fill_drive();
    question = question_open(true, NULL);
    diagnosis = (answer_t){.question = question};
    make_bank_model(&diagnosis.baseline, RATE_HZ, 1.0, 3, weights, thresholds);
    model_copy(&diagnosis.given, &diagnosis.baseline);
    model_copy(&diagnosis.model, &diagnosis.baseline);
    add_resonance(&diagnosis.model, 180.0, 0.05);
    for (size_t i = 0; i < RECORDINGS; i++) {
        simulate_into(&recordings[i], &diagnosis.model, 1);
        for (size_t k = 0; k < SAMPLES; k++) {
            recordings[i].column[COLUMN_DISPLACEMENT][k] += NOISE_UM * random_normal(&rng);
        }
    }
    TEST_ASSERT_TRUE(samples_open(&question->samples, &diagnosis.baseline, recordings, RECORDINGS, &failure));
    question->noise = (noise_t){.sigma_um = NOISE_UM, .rms_um = NOISE_UM, .at_rest = true};
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
    answer_free(&diagnosis);
}

void work_out(void) {
    TEST_ASSERT_TRUE_MESSAGE(findings_errors(&diagnosis, &failure), failure.text);
    TEST_ASSERT_TRUE_MESSAGE(account_for(&diagnosis, recordings, RECORDINGS, &account, &failure), failure.text);
}

json_t *as_json(void) {
    json_t *json = diagnosis_to_json(&diagnosis, &account, recordings, RECORDINGS);
    TEST_ASSERT_NOT_NULL(json);
    return json;
}

void expect_format(json_t *json, const char *format, ...) {
    va_list arguments;
    json_error_t error;
    va_start(arguments, format);
    const int status = json_vunpack_ex(json, &error, JSON_STRICT, format, arguments);
    va_end(arguments);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, status, error.text);
}
