/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What blocks say beside a hysteresis of any shape: nothing where nothing is missing, and their name where they are. */
#include "belief/kept_chains.h"
#include "belief/rivals.h"
#include "belief/shape.h"
#include "belief/suspect_fit.h"
#include "chain/catalogue.h"
#include "diagnosis/question/question.h"
#include "support.h"
#include "thresholds/thresholds.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 6000, FINER = 20, BANK = 200 };
static const double rate_hz = 1000.0;
static double noise_um = 0.005;   /* 0.05 % of the stroke */
static const double weak = 0.012; /* 3.6 us late: 17 to 44 natural units with six seeds */
static double part_of_delay = 1.0;
static const double mode_hz = 20.0, mode_damping = 0.067;
static const double leaks_in_s = 8.0, rest_um = 40.0; /* where it has leaked to when the recording begins */
static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* Three speeds and all sizes from 0.6 to 1, and a hold: -1 .. 1. */
static double drive_at(double t) {
    const double cycles = t < 2.0 ? 2.0 * t : t < 4.0 ? 4.0 + 7.0 * (t - 2.0) : 18.0 + 25.0 * (t - 4.0);
    /* No jumps: the laws below are integrated in small steps. */
    return t < 0.3 ? 0.0 : sin(2.0 * M_PI * (cycles - 0.6)) * (0.8 - 0.2 * cos(M_PI * (t - 0.3)));
}

typedef enum { PLAYS, BOUC_WEN, CURVED_PLAYS, LAWS } law_t;
typedef enum { NOTHING, LATE, CREEPS, SHAKES, RINGS, LEAKS } effect_t;

/* The drive between the samples is known here and nowhere else. size_um: of the effect, root mean square. */
static void make_recording(law_t law, effect_t effect, recording_t *recording) {
    double play[BANK] = {0.0}, z = 0.0, before = 0.0, slow[4] = {0.0}, shake[3] = {0.0}, mode[2] = {0.0}, leaked = 0.0;
    recording_create(recording, "made", rate_hz, SAMPLES);
    for (size_t k = 0; k < SAMPLES * FINER; k++) {
        const double t = (double)k / FINER / rate_hz;
        /* 0.3 ms late at 25 Hz and 3.5 um: 10 times the noise and more. */
        const double now = drive_at(effect == LATE ? t - part_of_delay * 3e-4 : t);
        double sum = 0.0;
        for (size_t i = 0; i < BANK; i++) {
            const double r = 1.2 * ((double)i + 0.5) / BANK;
            play[i] = fmax(now - r, fmin(now + r, play[i]));
            sum += exp(-r / 0.3) / BANK * (law == CURVED_PLAYS ? sinh(1.2 * play[i]) : play[i]);
        }
        const double change = now - before;
        z += change * (1.0 - (0.7 * copysign(1.0, change * z) + 0.3) * pow(fabs(z) / 0.15, 1.5));
        before = now;
        double position = 5.0 * now + (law == BOUC_WEN ? -4.0 * z : 3.0 * sum);
        /* Four relaxations of 0.01 to 10 s, 1 % each: creep of 2.3 % a decade. */
        for (size_t i = 0; effect == CREEPS && i < 4; i++) {
            slow[i] += (position - slow[i]) * (1.0 - exp(-1.0 / (rate_hz * FINER * 0.01 * pow(10.0, (double)i))));
        }
        for (size_t i = 0; effect == CREEPS && i < 4; i++) {
            position += 0.01 * slow[i];
        }
        if (effect == RINGS) { /* in steps of a 2500th of its period */
            const double step = 2.0 * M_PI * mode_hz / (rate_hz * FINER);
            mode[1] += step * (position - mode[0] - 2.0 * mode_damping * mode[1]);
            mode[0] += step * mode[1];
            position = mode[0];
        }
        if (effect == LEAKS) {
            leaked = k == 0 ? position : leaked + (position - leaked) / (rate_hz * FINER * leaks_in_s);
            position += rest_um - leaked;
        }
        if (effect == SHAKES && k % FINER == 0) { /* 1/f from 0.5 Hz on, and only while the drive moves */
            for (size_t i = 0; i < 3; i++) {
                const double pole = exp(-2.0 * M_PI * 0.5 * pow(10.0, (double)i) / rate_hz);
                shake[i] = pole * shake[i] + (t < 0.3 ? 0.0 : sqrt(1.0 - pole * pole) * noise_um * random_normal(&rng));
            }
        }
        position += shake[0] + shake[1] + shake[2];
        if (k % FINER == 0) {
            recording->column[COLUMN_DRIVE][k / FINER] = 50.0 + 50.0 * drive_at(t);
            recording->column[COLUMN_DISPLACEMENT][k / FINER] = position + noise_um * random_normal(&rng);
        }
    }
}

static probe_setting_t setting_of(const recording_t *recording) {
    const double *displacement = recording->column[COLUMN_DISPLACEMENT];
    probe_setting_t setting = {.drive_low_v = 0.0,
                               .drive_high_v = 100.0,
                               .sample_rate_hz = rate_hz,
                               .longest_s = SAMPLES / rate_hz,
                               .largest_rate_v_per_s = 50.0 * 2.0 * M_PI * 25.0,
                               .displacement_low_um = displacement[0],
                               .displacement_high_um = displacement[0]};
    for (size_t k = 0; k < SAMPLES; k++) {
        setting.displacement_low_um = fmin(setting.displacement_low_um, displacement[k]);
        setting.displacement_high_um = fmax(setting.displacement_high_um, displacement[k]);
    }
    return setting;
}

/* The operator alone. loudest: the suspect that is worth most beside it, if one is heard. Its chain is to be freed. */
static void ask(const recording_t *recording, shape_t *shape, suspect_t *loudest) {
    model_t chain, operated;
    samples_t samples;
    fitted_chain_t fitted;
    failure_t failure;
    const double weight = 0.1;
    const probe_setting_t setting = setting_of(recording);
    make_bank_model(&chain, rate_hz, 0.0, 0, &weight, NULL);
    TEST_ASSERT_TRUE(samples_open(&samples, &chain, recording, 1, &failure));
    chain_for_operator(&chain, &operated);
    TEST_ASSERT_TRUE(fitted_chain_open(&fitted, &samples, &operated, NULL));
    shape_of(&fitted, 0.0, shape);
    shape_scan(&fitted, &setting, shape);
    TEST_ASSERT_TRUE(shape->fitted);
    TEST_ASSERT_TRUE(fitted_chain_is_of(&fitted, &samples, &chain)); /* whatever its hysteresis */
    TEST_ASSERT_FALSE(fitted_chain_is_of(&(fitted_chain_t){0}, &samples, &chain));
    *loudest = (suspect_t){0};
    if (!shape->silent) {
        const suspects_t *suspects = fitted_suspects(&fitted, &setting);
        TEST_ASSERT_TRUE(suspects->count > 0);
        *loudest = suspects->suspect[0];
        model_copy(&loudest->chain, &suspects->suspect[0].chain);
    }
    fitted_chain_close(&fitted);
    samples_close(&samples);
    model_free(&operated);
    model_free(&chain);
}

/* Of a recording that is made for it. */
static void ask_of(law_t law, effect_t effect, shape_t *shape, suspect_t *loudest) {
    recording_t recording;
    make_recording(law, effect, &recording);
    ask(&recording, shape, loudest);
    recording_free(&recording);
}

static void test_nothing_is_said_where_nothing_is_missing(void) {
    for (law_t law = PLAYS; law < LAWS; law++) {
        shape_t shape;
        suspect_t loudest;
        ask_of(law, NOTHING, &shape, &loudest);
        TEST_ASSERT_TRUE_MESSAGE(shape.silent, shape.loudest->name);
        TEST_ASSERT_TRUE(shape.whole);
        TEST_ASSERT_TRUE(shape.deviations > 0.9);
    }
}

/* With a hundredth of that noise the operator does not quite reach it. What it leaves is less than any hysteresis is
 * known by. */
static void test_errors_of_the_operator_are_no_structure(void) {
    shape_t shape;
    suspect_t loudest;
    const double usual = noise_um;
    noise_um /= 100.0;
    ask_of(BOUC_WEN, NOTHING, &shape, &loudest);
    noise_um = usual;
    if (!shape.silent) {
        model_free(&loudest.chain);
    }
    TEST_ASSERT_TRUE(shape.deviations > threshold.most_deviations); /* else the test says nothing */
    TEST_ASSERT_TRUE(shape.whole);
}

static void test_an_effect_is_heard_whatever_the_law(void) {
    static const char *const group[] = {[LATE] = "lag", [CREEPS] = "slow"};
    for (effect_t effect = LATE; effect <= CREEPS; effect++) {
        for (law_t law = PLAYS; law < LAWS; law++) {
            shape_t shape;
            suspect_t loudest;
            ask_of(law, effect, &shape, &loudest);
            TEST_ASSERT_FALSE(shape.silent);
            TEST_ASSERT_EQUAL_STRING(group[effect], shape.loudest->probe->group);
            TEST_ASSERT_EQUAL_STRING(group[effect], loudest.block->probe->group);
            TEST_ASSERT_TRUE(loudest.refined);
            TEST_ASSERT_TRUE(loudest.gain >= threshold.least_gain);
            model_free(&loudest.chain);
        }
    }
}

/* The drive passes through the mode, and the operator without it leaves a good part of the stroke. */
static void test_a_mode_within_what_the_drive_excites(void) {
    shape_t shape;
    suspect_t loudest;
    ask_of(BOUC_WEN, RINGS, &shape, &loudest);
    TEST_ASSERT_FALSE(shape.silent);
    TEST_ASSERT_EQUAL_STRING("resonance", loudest.block->name);
    const parameter_t *parameter = loudest.chain.block[loudest.at].parameter;
    /* By noise alone both are known to 0.1 %; turns of the drive that the mode hides cost the rest. */
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * mode_hz, mode_hz, parameter[0].value[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * mode_damping, mode_damping, parameter[1].value[0]);
    model_free(&loudest.chain);
}

/* A leakage lets no constant through, and the position that it goes to is far from where the drive alone would have it.
 * A drift follows it nearly. */
static void test_a_leakage_far_from_zero(void) {
    for (law_t law = PLAYS; law < (INSTRUMENTED ? PLAYS + 1 : LAWS); law++) { /* one law's code is the other's */
        shape_t shape;
        suspect_t loudest;
        ask_of(law, LEAKS, &shape, &loudest);
        TEST_ASSERT_FALSE(shape.silent);
        TEST_ASSERT_EQUAL_STRING("charge_leakage", loudest.block->name);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * leaks_in_s, leaks_in_s, loudest.chain.block[loudest.at].parameter[0].value[0]);
        model_free(&loudest.chain);
    }
}

/* The fit of a chain is not that of another one: with a block more, with another number, to other samples. */
static void test_a_fit_is_of_its_chain(void) {
    const double delay[][1] = {{1e-3}, {1.1e-3}};
    recording_t recording;
    model_t alone, chain[2];
    samples_t samples, other;
    fitted_chain_t fitted;
    failure_t failure;
    make_recording(PLAYS, LATE, &recording);
    imitation_chain(rate_hz, &alone);
    TEST_ASSERT_TRUE(samples_open(&samples, &alone, &recording, 1, &failure));
    TEST_ASSERT_TRUE(samples_open(&other, &alone, &recording, 1, &failure));
    for (int i = 0; i < 2; i++) {
        insert_block(&chain[i], &alone, &block_transport_delay, delay[i]);
    }
    TEST_ASSERT_TRUE(fitted_chain_open(&fitted, &samples, &chain[0], NULL));
    TEST_ASSERT_TRUE(fitted_chain_is_of(&fitted, &samples, &chain[0]));
    TEST_ASSERT_FALSE(fitted_chain_is_of(&fitted, &samples, &chain[1]));
    TEST_ASSERT_FALSE(fitted_chain_is_of(&fitted, &samples, &alone));
    TEST_ASSERT_FALSE(fitted_chain_is_of(&fitted, &other, &chain[0]));
    fitted_chain_close(&fitted);
    for (int i = 0; i < 2; i++) {
        model_free(&chain[i]);
    }
    samples_close(&samples);
    samples_close(&other);
    model_free(&alone);
    recording_free(&recording);
}

/* The operator calls slow changes noise. They are none where the sensor at rest is far quieter. */
static void test_what_is_far_more_than_the_noise_is_none(void) {
    recording_t recording;
    model_t chain;
    question_t question = {.noise = {.at_rest = true}};
    fitted_chain_t fitted;
    failure_t failure;
    make_recording(PLAYS, NOTHING, &recording);
    imitation_chain(rate_hz, &chain);
    TEST_ASSERT_TRUE(samples_open(&question.samples, &chain, &recording, 1, &failure));
    TEST_ASSERT_TRUE(fitted_chain_open(&fitted, &question.samples, &chain, NULL));
    question.noise.rms_um = noise_um;
    question_imitate(&question, &fitted);
    TEST_ASSERT_TRUE(question.shape.whole);
    const double left_um = question.shape.left_um;
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * noise_um, noise_um, left_um); /* the operator's errors are a tenth of it */
    for (int quieter = 0; quieter < 2; quieter++) {
        question.noise.rms_um = (quieter == 0 ? 1.01 : 0.9) * left_um / threshold.most_over_noise;
        question_imitate(&question, &fitted);
        TEST_ASSERT_EQUAL_INT(quieter == 0, question.shape.whole);
    }
    /* Steps of a converter are as loud as a 12th of their square. */
    question.step_um = 1.3 * left_um;
    question_imitate(&question, &fitted);
    TEST_ASSERT_TRUE(question.shape.whole);
    fitted_chain_close(&fitted);
    samples_close(&question.samples);
    model_free(&chain);
    recording_free(&recording);
}

/* Behind a curve of the sensor that bends by a quarter of the stroke the operator's position and what the curve adds to
 * it settle: what the fit leaves is the noise. Taken out as it came, round by round, it left 3.1 of it after four. */
static void test_a_fit_behind_a_strong_curve_settles(void) {
    const double curve[] = {-0.02, 0.27, 0.0, 8.0}, half_um = curve[3];
    recording_t recording;
    model_t alone, chain;
    samples_t samples;
    fitted_chain_t fitted;
    failure_t failure;
    double sum = 0.0;
    make_recording(PLAYS, NOTHING, &recording);
    double *displacement = recording.column[COLUMN_DISPLACEMENT];
    for (size_t k = 0; k < SAMPLES; k++) {
        const double s = displacement[k] / half_um;
        TEST_ASSERT_TRUE(fabs(s) < 1.0); /* within the range */
        displacement[k] = half_um * (s + curve[0] * s * s + curve[1] * s * s * s) + noise_um * random_normal(&rng);
    }
    imitation_chain(rate_hz, &alone);
    insert_block(&chain, &alone, &block_static_nonlinearity, curve);
    TEST_ASSERT_TRUE(samples_open(&samples, &alone, &recording, 1, &failure));
    TEST_ASSERT_TRUE(fitted_chain_open(&fitted, &samples, &chain, NULL));
    for (size_t k = 0; k < SAMPLES; k++) {
        const double left_um = displacement[k] - fitted.imitation.simulated_um[k];
        sum += left_um * left_um;
    }
    /* The noise before the curve goes through its slope, 1 to 1.8; that behind it is as it was. */
    const double left = sqrt(sum / SAMPLES) / noise_um;
    printf("left: %g of the noise\n", left);
    TEST_ASSERT_TRUE(left > 1.2 && left < 2.1);
    fitted_chain_close(&fitted);
    samples_close(&samples);
    model_free(&chain);
    model_free(&alone);
    recording_free(&recording);
}

/* Chains that are fitted side by side have the fits that each has alone. They are kept, and those that are
 * wanted again stay, though they are the oldest. */
static void test_fits_side_by_side_are_kept(void) {
    enum { CHAINS = KEPT_CHAINS + 1 };
    recording_t recording;
    model_t chain[CHAINS];
    const model_t *all[CHAINS];
    samples_t samples;
    fitted_chain_t alone;
    kept_chains_t kept = {0};
    failure_t failure;
    make_recording(PLAYS, LATE, &recording);
    imitation_chain(rate_hz, &chain[0]);
    TEST_ASSERT_TRUE(samples_open(&samples, &chain[0], &recording, 1, &failure));
    for (size_t i = 1; i < CHAINS; i++) {
        const double delay_s = 1e-3 * (double)i;
        insert_block(&chain[i], &chain[0], &block_transport_delay, &delay_s);
    }
    for (size_t i = 0; i < CHAINS; i++) {
        all[i] = &chain[i];
    }
    kept_chains_prepare(&kept, &samples, all, KEPT_CHAINS);
    const fitted_chain_t *first = kept_chain(&kept, &samples, &chain[0]);
    TEST_ASSERT_EQUAL_UINT64(KEPT_CHAINS, kept.made);
    TEST_ASSERT_TRUE(fitted_chain_open(&alone, &samples, &chain[1], NULL));
    TEST_ASSERT_TRUE(alone.hysteresis.evidence.log_evidence ==
                     kept_chain(&kept, &samples, &chain[1])->hysteresis.evidence.log_evidence);
    const model_t *new_and_oldest[] = {all[KEPT_CHAINS], all[0]};
    const double *weight = first->hysteresis.evidence.weight;
    kept_chains_prepare(&kept, &samples, new_and_oldest, 2);
    TEST_ASSERT_TRUE(kept_chain(&kept, &samples, &chain[0])->hysteresis.evidence.weight == weight);
    TEST_ASSERT_TRUE(fitted_chain_is_of(kept_chain(&kept, &samples, &chain[KEPT_CHAINS]), &samples, all[KEPT_CHAINS]));
    fitted_chain_close(&alone);
    kept_chains_close(&kept);
    for (size_t i = 0; i < CHAINS; i++) {
        model_free(&chain[i]);
    }
    samples_close(&samples);
    recording_free(&recording);
}

/* A delay that is worth less than the scan's limit: other lags are worth as much. Weaker is not surer. */
static void test_a_weak_effect_has_rivals(void) {
    recording_t recording;
    model_t chain;
    samples_t samples;
    fitted_chain_t fitted;
    rivals_t rivals;
    failure_t failure;
    part_of_delay = weak;
    make_recording(PLAYS, LATE, &recording);
    part_of_delay = 1.0;
    const probe_setting_t setting = setting_of(&recording);
    imitation_chain(rate_hz, &chain);
    TEST_ASSERT_TRUE(samples_open(&samples, &chain, &recording, 1, &failure));
    TEST_ASSERT_TRUE(fitted_chain_open(&fitted, &samples, &chain, NULL));
    rivals_of(&fitted, &setting, &block_transport_delay, NULL, &rivals);
    /* Else the test says nothing. */
    TEST_ASSERT_TRUE(rivals.gain > threshold.evidence_margin && rivals.gain < threshold.least_gain);
    TEST_ASSERT_TRUE(rivals.best_gain > rivals.gain - threshold.evidence_margin);
    TEST_ASSERT_TRUE(rivals.count > 0);
    fitted_chain_close(&fitted);
    samples_close(&samples);
    model_free(&chain);
    recording_free(&recording);
}

/* A delay that grows until it is heard is then worth less than a probe with an amplitude of its own would have to be.
 * Each is worth a sixth more than the last one, beside 6 of chance. */
static void test_what_is_small_is_heard_once_its_numbers_are_searched(void) {
    suspect_t loudest = {0};
    for (int twelfths = 12; twelfths < 1000 && loudest.block == NULL; twelfths++) {
        shape_t shape;
        part_of_delay = weak * twelfths / 12.0;
        ask_of(PLAYS, LATE, &shape, &loudest);
    }
    part_of_delay = 1.0;
    TEST_ASSERT_NOT_NULL(loudest.block);
    TEST_ASSERT_EQUAL_STRING(block_transport_delay.probe->group, loudest.block->probe->group);
    TEST_ASSERT_TRUE(loudest.gain >= threshold.least_searched_gain && loudest.gain < threshold.least_gain);
    model_free(&loudest.chain);
}

/* Like 1/f noise, beside which the operator leaves nothing: but it is not there while the drive rests. */
static void test_what_acts_in_motion_alone_is_no_noise(void) {
    for (law_t law = PLAYS; law < LAWS; law++) {
        shape_t shape;
        suspect_t loudest;
        ask_of(law, SHAKES, &shape, &loudest);
        TEST_ASSERT_FALSE(shape.whole);
        TEST_ASSERT_TRUE_MESSAGE(shape.silent, "no block of the catalogue does that");
    }
}

/* Against the covariance written out: y has the operator's weights in it, and they are integrated out. A few samples
 * only: the matrix is theirs. */
static void test_what_is_beyond_agrees_with_a_direct_computation(void) {
    enum { FEW = 300, COLUMNS = 2 };
    double drive[FEW], y[FEW], s[FEW], product[COLUMNS * COLUMNS];
    unsigned char use[FEW];
    operator_path_t path;
    hysteresis_t h;
    hysteresis_bases_t bases = {0};
    failure_t failure;
    for (size_t k = 0; k < FEW; k++) {
        drive[k] = sin(2.0 * M_PI * (double)k / 50.0) * (1.0 + 0.003 * (double)k);
        y[k] = drive[k] + 0.1 * random_normal(&rng);
        s[k] = (double)k / FEW;
        use[k] = k % 7 != 3;
    }
    operator_path_open(&path, drive, NULL, FEW);
    const hysteresis_data_t data = {&path, 1, y, use, 1, NULL};
    TEST_ASSERT_TRUE(hysteresis_fit(&data, NULL, &bases, &h, &failure));
    const double *column[COLUMNS] = {h.position_um, s};
    hysteresis_rows_t rows;
    hysteresis_rows_open(&rows, &h, &path, 1, use, 1);
    hysteresis_beyond(&rows, COLUMNS, column, product);
    /* Beyond all columns a signature is smaller than it was; and a column that is one of the operator's, the drive, has
     * next to nothing left, for its weight is free. */
    double square = 0.0;
    for (size_t k = 0; k < FEW; k++) {
        square += use[k] != 0 ? s[k] * s[k] / h.evidence.variance : 0.0;
    }
    TEST_ASSERT_TRUE(product[3] > 0.0 && product[3] < square);
    TEST_ASSERT_EQUAL_DOUBLE(product[1], product[2]);
    column[1] = drive;
    hysteresis_beyond(&rows, COLUMNS, column, product);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, product[3] * h.evidence.variance / FEW);
    /* s' C^-1 y by what the operator leaves of y: C^-1 y = (y - X w) / variance. White noise only. */
    if (h.noise.sections == 0) {
        double *left = allocate(FEW, sizeof(double)), along = 0.0;
        column[1] = s;
        hysteresis_beyond(&rows, COLUMNS, column, product);
        hysteresis_left(&h, &path, 1, h.position_um, use, left, NULL);
        for (size_t k = 0; k < FEW; k++) {
            along += use[k] != 0 ? s[k] * left[k] / h.evidence.variance : 0.0;
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-4 * sqrt(product[3]), along, product[1]);
        free(left);
    }
    hysteresis_rows_close(&rows);
    hysteresis_bases_close(&bases);
    hysteresis_free(&h);
    operator_path_close(&path);
}

int main(void) {
    rng = random_start("belief", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_what_is_beyond_agrees_with_a_direct_computation);
    RUN_TEST(test_nothing_is_said_where_nothing_is_missing);
    RUN_TEST(test_a_leakage_far_from_zero);
    RUN_TEST(test_a_fit_is_of_its_chain);
    RUN_TEST(test_what_is_far_more_than_the_noise_is_none);
    RUN_TEST(test_a_fit_behind_a_strong_curve_settles);
    RUN_TEST(test_fits_side_by_side_are_kept);
    RUN_TEST(test_a_weak_effect_has_rivals);
    RUN_TEST(test_what_is_small_is_heard_once_its_numbers_are_searched);
    if (!INSTRUMENTED) { /* nine recordings more, with the code that the leakage and the small effect run */
        RUN_TEST(test_a_mode_within_what_the_drive_excites);
        RUN_TEST(test_what_acts_in_motion_alone_is_no_noise);
        RUN_TEST(test_errors_of_the_operator_are_no_structure);
        RUN_TEST(test_an_effect_is_heard_whatever_the_law);
    }
    return UNITY_END();
}
