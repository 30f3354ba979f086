/* SPDX-License-Identifier: MIT */
/* Creep cells: against double precision, exactness of the inverse, log-time response, extremes. */
#include "hyst/creep.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static hyst_creep_t accept(uint32_t cells, const hyst_creep_cell_t cell[]) {
    hyst_creep_t creep;
    uint32_t element;
    TEST_ASSERT_EQUAL_INT(HYST_CREEP_OK, hyst_creep_build(&creep, cells, cell, &element));
    return creep;
}

static hyst_creep_t random_creep(void) {
    hyst_creep_cell_t cell[HYST_CREEP_MAX_CELLS];
    const uint32_t cells = (uint32_t)(random_bits(&rng) % (HYST_CREEP_MAX_CELLS + 1U));
    for (uint32_t j = 0; j < cells; j++) {
        cell[j].gain = random_q31(&rng) / HYST_CREEP_MAX_CELLS;
        cell[j].rate = (random_q31(&rng) & INT32_MAX) >> (random_bits(&rng) % 31U) | 1;
    }
    return accept(cells, cell);
}

static int32_t next_input(int32_t h) {
    const double kind = random_unit(&rng);
    return kind < 0.01  ? (random_bits(&rng) % 2U != 0 ? INT32_MAX : INT32_MIN)
           : kind < 0.1 ? random_q31(&rng)
           : kind < 0.6 ? hyst_add(h, random_q31(&rng) >> 16)
                        : h;
}

/* Forward after inverse is the identity to the bit wherever the inverse did not saturate. */
static void test_composition_is_exact(void) {
    uint64_t composed = 0;
    for (int run = 0; run < 500; run++) {
        const hyst_creep_t creep = random_creep();
        hyst_creep_state_t inverse, forward;
        hyst_creep_settle(&creep, &inverse, 0);
        hyst_creep_settle(&creep, &forward, 0);
        int32_t y = 0;
        for (int k = 0; k < 5000; k++) {
            y = next_input(y);
            const int64_t wanted = y - hyst_creep_offset(&creep, &inverse);
            const int32_t h = hyst_saturate(wanted);
            const int32_t got = hyst_saturate(h + hyst_creep_offset(&creep, &forward));
            if (h == wanted) {
                TEST_ASSERT_EQUAL_INT32(y, got);
                composed++;
            }
            hyst_creep_advance(&creep, &inverse, h);
            hyst_creep_advance(&creep, &forward, h);
        }
    }
    TEST_ASSERT_TRUE(composed > 1000000);
}

/*
 * Each cell loses at most 2^-31 of full scale of the difference per sample, times its rate: a bias of 1 unit of Q31 at
 * most once the rate has summed it up. The offset rounds each level (1/2) and the sum (1/2). Gains add up to less than
 * 1: 2 units and a half.
 */
static void test_follows_double_precision(void) {
    double worst = 0.0;
    for (int run = 0; run < 200; run++) {
        const hyst_creep_t creep = random_creep();
        hyst_creep_state_t state;
        hyst_creep_settle(&creep, &state, 0);
        double level[HYST_CREEP_MAX_CELLS] = {0.0};
        int32_t h = 0;
        for (int k = 0; k < 5000; k++) {
            double expected = 0.0;
            for (uint32_t j = 0; j < creep.cells; j++) {
                expected += creep.cell[j].gain * 0x1p-31 * level[j];
                level[j] += creep.cell[j].rate * 0x1p-31 * (h - level[j]);
            }
            worst = fmax(worst, fabs((double)hyst_creep_offset(&creep, &state) - expected));
            hyst_creep_advance(&creep, &state, h);
            h = next_input(h);
        }
    }
    printf("creep against double precision: worst difference %.2f * 2^-31\n", worst);
    TEST_ASSERT_TRUE(worst <= 2.5);
}

/* Two cells a decade from 10 ms to 1000 s, gamma = 2 % per decade: a straight line over log t within 3 % of gamma at 10
 * kHz. */
static void test_step_response_is_logarithmic(void) {
    hyst_creep_cell_t cell[11];
    const double gamma = 0.02;
    for (int j = 0; j < 11; j++) {
        cell[j].gain = (hyst_q31_t)lround(gamma / 2.0 * 0x1p31);
        cell[j].rate = (hyst_q31_t)lround(-expm1(-1e-4 / (0.01 * pow(10.0, j / 2.0))) * 0x1p31);
    }
    const hyst_creep_t creep = accept(11, cell);
    hyst_creep_state_t state;
    hyst_creep_settle(&creep, &state, 0);
    const int32_t h = HYST_Q31_MAX / 2;
    double at_decade[3];
    unsigned decade = 0;
    for (long k = 0; k <= 1000000; k++) { /* 100 s */
        if (k == 10000 || k == 100000 || k == 1000000) {
            at_decade[decade++] = (double)hyst_creep_offset(&creep, &state) / h;
        }
        hyst_creep_advance(&creep, &state, h);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * gamma, gamma, at_decade[1] - at_decade[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * gamma, gamma, at_decade[2] - at_decade[1]);
}

/* A cell that sees the ends without end never leaves them, and nothing wraps (UBSan looks on). */
static void test_extremes_do_not_wrap(void) {
    hyst_creep_cell_t cell[2] = {{.gain = HYST_Q31_MAX / 2, .rate = HYST_Q31_MAX},
                                 {.gain = -HYST_Q31_MAX / 2, .rate = 1}};
    const hyst_creep_t creep = accept(2, cell);
    hyst_creep_state_t state;
    hyst_creep_settle(&creep, &state, INT32_MIN);
    for (int k = 0; k < 100000; k++) {
        hyst_creep_advance(&creep, &state, k % 2 == 0 ? INT32_MAX : INT32_MIN);
        const int64_t offset = hyst_creep_offset(&creep, &state);
        TEST_ASSERT_TRUE(offset <= INT32_MAX && offset >= INT32_MIN);
    }
}

static void test_refusals(void) {
    hyst_creep_cell_t cell[HYST_CREEP_MAX_CELLS + 1];
    memset(cell, 0, sizeof cell);
    hyst_creep_t creep;
    uint32_t element;
    TEST_ASSERT_EQUAL_INT(HYST_CREEP_TOO_MANY_CELLS,
                          hyst_creep_build(&creep, HYST_CREEP_MAX_CELLS + 1, cell, &element));
    TEST_ASSERT_EQUAL_INT(HYST_CREEP_RATE_NOT_POSITIVE, hyst_creep_build(&creep, 1, cell, &element));
    cell[0] = (hyst_creep_cell_t){INT32_MAX, 1};
    cell[1] = (hyst_creep_cell_t){-1, 1};
    TEST_ASSERT_EQUAL_INT(HYST_CREEP_GAIN_TOO_LARGE, hyst_creep_build(&creep, 2, cell, &element));
    TEST_ASSERT_EQUAL_UINT32(1, element);
    cell[0].gain = INT32_MIN;
    TEST_ASSERT_EQUAL_INT(HYST_CREEP_GAIN_TOO_LARGE, hyst_creep_build(&creep, 1, cell, &element));
}

/* The cells to the last bit, by their equations in 128 bits: rates up to 1 and steps between the ends of the range,
 * after which a level lies outside of it by rounding, and its distance from the other end is 2^31 units of Q30. */
static void test_cells_are_their_equations(void) {
    int beyond = 0;
    for (int run = 0; run < 3000; run++) {
        hyst_creep_cell_t cell[4];
        for (int j = 0; j < 4; j++) {
            cell[j].gain = random_q31(&rng) / 5;
            cell[j].rate = HYST_Q31_MAX - (random_unit(&rng) < 0.5 ? random_between(&rng, 0, 3) : 0);
            if (random_unit(&rng) < 0.3) {
                cell[j].rate = (random_q31(&rng) & INT32_MAX) | 1;
            }
        }
        hyst_creep_t creep;
        uint32_t element;
        TEST_ASSERT_EQUAL_INT(HYST_CREEP_OK, hyst_creep_build(&creep, 4, cell, &element));
        hyst_creep_state_t state;
        hyst_creep_settle(&creep, &state, random_q31(&rng));
        for (int k = 0; k < 100; k++) {
            const hyst_q31_t ends[] = {INT32_MIN, INT32_MIN, INT32_MAX, INT32_MIN + random_between(&rng, 0, 3)};
            const hyst_q31_t h = random_unit(&rng) < 0.8 ? ends[random_bits(&rng) % 4U] : random_q31(&rng);
            __int128 offset = 0;
            int64_t expected[4];
            for (int j = 0; j < 4; j++) {
                const __int128 s = state.level[j];
                const __int128 level = (s + (1 << 29)) >> 30;
                offset += (__int128)cell[j].gain * (level > INT32_MAX   ? INT32_MAX
                                                    : level < INT32_MIN ? INT32_MIN
                                                                        : level);
                const __int128 difference = ((__int128)h * HYST_Q30_ONE - s + (1 << 30)) >> 31;
                beyond += difference > INT32_MAX ? 1 : 0;
                expected[j] = (int64_t)(s + difference * cell[j].rate);
            }
            TEST_ASSERT_EQUAL_INT64((int64_t)((offset + (1 << 30)) >> 31), hyst_creep_offset(&creep, &state));
            hyst_creep_advance(&creep, &state, h);
            for (int j = 0; j < 4; j++) {
                TEST_ASSERT_EQUAL_INT64(expected[j], state.level[j]);
            }
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(beyond > 0, "the distance that does not fit into 32 bits was met");
}

int main(void) {
    rng = random_start("test_creep", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_cells_are_their_equations);
    RUN_TEST(test_composition_is_exact);
    RUN_TEST(test_follows_double_precision);
    RUN_TEST(test_step_response_is_logarithmic);
    RUN_TEST(test_extremes_do_not_wrap);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
