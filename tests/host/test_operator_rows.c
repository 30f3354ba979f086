/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rows of the universal operator: those for several noises, and those that are kept from fit to fit. */
#include "base/failure.h"
#include "operator/equations.h"
#include "operator/hysteresis.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

enum { FEW_SAMPLES = 150 };

void setUp(void) {
}
void tearDown(void) {
}

/* 0 to 100 V, and no path that comes again. */
static double two_sines(double cycles) {
    return 50.0 + 32.0 * sin(2.0 * M_PI * cycles) + 18.0 * sin(2.0 * M_PI * 3.7 * cycles);
}

/* What rows are made of: two recordings with a few samples that are not used, behind a filter that looks ahead. */
typedef struct {
    double drive[2][FEW_SAMPLES], position[2 * FEW_SAMPLES];
    unsigned char use[2 * FEW_SAMPLES];
    operator_path_t path[2];
    hysteresis_data_t data;
    operator_question_t question;
    hysteresis_bases_t bases;
    hysteresis_t h;
} rows_bench_t;

static const state_space_t read_early = {.states = 1, .ahead = 1, .b = {1.0}, .c = {0.5}, .d = 0.5};

static rows_bench_t *open_rows_bench(const state_space_t *behind) {
    const double range_v[2] = {-10.0, 110.0};
    rows_bench_t *bench = allocate(1, sizeof *bench);
    for (size_t i = 0; i < 2; i++) {
        for (size_t k = 0; k < FEW_SAMPLES; k++) {
            bench->drive[i][k] = two_sines((double)k / 90.0 + 0.3 * (double)i);
            bench->use[i * FEW_SAMPLES + k] = k % 9 != 4;
        }
        operator_path_open(&bench->path[i], bench->drive[i], NULL, FEW_SAMPLES);
    }
    bench->data = (hysteresis_data_t){bench->path, 2, bench->position, bench->use, 1, behind};
    bench->question = (operator_question_t){.data = &bench->data,
                                            .bases = &bench->bases,
                                            .behind = *behind,
                                            .longest = FEW_SAMPLES,
                                            .position_um = bench->position};
    operator_create(&bench->h.operator, range_v, 2);
    bench->h.turns = true;
    return bench;
}

static void close_rows_bench(rows_bench_t *bench) {
    hysteresis_bases_close(&bench->bases);
    operator_free(&bench->h.operator);
    operator_path_close(&bench->path[0]);
    operator_path_close(&bench->path[1]);
    free(bench);
}

/* Of which the same are kept, with the same values to the last bit. */
static void check_same_rows(const kept_rows_t *one, const kept_rows_t *other) {
    TEST_ASSERT_EQUAL_UINT64(one->rows, other->rows);
    TEST_ASSERT_EQUAL_MEMORY(one->sample, other->sample, one->rows * sizeof(size_t));
    for (size_t i = 0; i < one->rows * one->columns; i++) {
        TEST_ASSERT_TRUE(one->row[i] == other->row[i]);
    }
}

/* Rows that one walk whitens for several noises are those of a walk for each, be one of the noises white or not. */
static void test_rows_for_several_noises_are_those_for_each(void) {
    const state_space_t behind[] = {state_space_identity(), read_early};
    for (size_t b = 0; b < 2; b++) {
        for (size_t thin = 1; thin < 4; thin++) {
            rows_bench_t *bench = open_rows_bench(&behind[b]);
            const double rho[ROWS_MOST_NOISES] = {0.0, 0.003, 0.2};
            pink_t noise[ROWS_MOST_NOISES];
            kept_rows_t together[ROWS_MOST_NOISES];
            const pink_t *noises[ROWS_MOST_NOISES];
            kept_rows_t *each[ROWS_MOST_NOISES];
            rows_wanted_t wanted = {.operator= & bench->h.operator,
                                    .paths = bench->path,
                                    .count = 2,
                                    .turns = true,
                                    .behind = &behind[b],
                                    .offsets_behind = b == 1,
                                    .use = bench->use,
                                    .thin = thin};
            for (size_t i = 0; i < ROWS_MOST_NOISES; i++) {
                pink_create(&noise[i], rho[i], FEW_SAMPLES);
                noises[i] = &noise[i];
                each[i] = &together[i];
            }
            kept_rows_open_each(each, &wanted, noises, ROWS_MOST_NOISES);
            for (size_t i = 0; i < ROWS_MOST_NOISES; i++) {
                kept_rows_t alone;
                wanted.noise = &noise[i];
                kept_rows_open(&alone, &wanted);
                TEST_ASSERT_TRUE(alone.rows > FEW_SAMPLES / 2);
                check_same_rows(&alone, &together[i]);
                kept_rows_close(&alone);
                kept_rows_close(&together[i]);
            }
            close_rows_bench(bench);
        }
    }
}

/* What was foreseen has the products that it would have had, and what is prepared stays, though it is the oldest. */
static void test_rows_that_are_kept(void) {
    rows_bench_t *bench = open_rows_bench(&read_early), *fresh = open_rows_bench(&read_early);
    const operator_question_t *q = &bench->question;
    const size_t n = bench->h.operator.columns;
    const double ahead[] = {0.01, 0.1, 0.02};
    equations_foresee(q, &bench->h, 1, ahead, 3);
    for (size_t i = 0; i < 3; i++) {
        pink_create(&bench->h.noise, ahead[i], FEW_SAMPLES);
        fresh->h.noise = bench->h.noise;
        const hysteresis_base_t *base = equations_base(q, &bench->h, 1),
                                *other = equations_base(&fresh->question, &fresh->h, 1);
        check_same_rows(&other->rows, &base->rows);
        TEST_ASSERT_EQUAL_MEMORY(other->gram, base->gram, n * n * sizeof(double));
    }
    for (size_t i = 3; i < HYSTERESIS_BASES; i++) {
        const base_place_t next = {true, 0.001 * (double)i};
        equations_prepare(q, &bench->h, 1, &next, 1);
    }
    const double *oldest = bench->bases.base[0].gram;
    const base_place_t both[] = {{false, 0.01}, {true, 0.01}};
    equations_prepare(q, &bench->h, 1, both, 2); /* the second one was the first that was made */
    for (int turns = 0; turns < 2; turns++) {
        pink_create(&bench->h.noise, 0.01, FEW_SAMPLES);
        bench->h.turns = turns != 0;
        const hysteresis_base_t *base = equations_base(q, &bench->h, 1);
        TEST_ASSERT_TRUE(base->turns == (turns != 0) && base->rho == 0.01);
        TEST_ASSERT_TRUE((base->gram == oldest) == (turns != 0));
    }
    close_rows_bench(bench);
    close_rows_bench(fresh);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_rows_for_several_noises_are_those_for_each);
    RUN_TEST(test_rows_that_are_kept);
    return UNITY_END();
}
