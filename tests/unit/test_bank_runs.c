/* SPDX-License-Identifier: MIT */
/*
 * The play bank with its precomputed keys against the one without (run_bank.h), run by run: histories that go anywhere,
 * goals one unit beside every corner, drives that are applied as solved, limited, or others, thresholds one unit apart,
 * growth up to its limit, memories carried over to other thresholds and back.
 */
#include "models.h"
#include "run_bank.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>

static random_t rng;
static uint64_t followed, searched, saturated_count, carried_count;

void setUp(void) {
}
void tearDown(void) {
}

typedef struct {
    hyst_pi_t model;
    hyst_pi_state_t state;
    run_bank_t bank;
    run_bank_state_t old;
} pair_t;

/* Random models; some with thresholds that are neighbours, some whose first operator begins at one unit, some whose
 * last one spans the range, some with the smallest or the largest slopes there are. */
static pi_arguments_t any_model(void) {
    static const uint32_t sizes[] = {0, 1, 2, 3, 16, HYST_PI_MAX_OPERATORS};
    const uint32_t size = random_unit(&rng) < 0.4 ? sizes[random_bits(&rng) % 6U] : (uint32_t)(random_bits(&rng) % 48U);
    pi_arguments_t a = pi_random(&rng, size, random_unit(&rng) < 0.5);
    const double kind = random_unit(&rng);
    for (uint32_t i = 0; i < size; i++) {
        if (kind < 0.2) {
            a.threshold[i] = (hyst_q31_t)(i + 1U);
        } else if (kind < 0.4) {
            a.threshold[i] = HYST_Q31_MAX - (hyst_q31_t)(size - i - 1U);
        } else if (kind < 0.6) {
            a.threshold[i] = (hyst_q31_t)((int64_t)HYST_Q31_MAX * (i + 1U) / (size + 1U));
        }
    }
    if (kind > 0.9) { /* the edges of what is accepted: flat at first, then as steep as can be */
        for (uint32_t i = 0; i <= size; i++) {
            a.weight[i] = i == 0 ? HYST_PI_MIN_SLOPE : 0;
        }
        a.weight[size / 2U] = (hyst_q28_t)(HYST_PI_MAX_WEIGHT_SUM - (size / 2U > 0 ? HYST_PI_MIN_SLOPE : 0));
        a.beta = 0;
        a.rate_gain = HYST_Q30_ONE;
    }
    return a;
}

static void expect_same(const pair_t *p) {
    TEST_ASSERT_EQUAL_UINT32(p->old.runs, p->state.runs);
    TEST_ASSERT_EQUAL_INT32(p->old.drive, p->state.drive);
    TEST_ASSERT_EQUAL_INT32(p->old.rate, p->state.rate);
    for (uint32_t k = 0; k < p->old.runs; k++) {
        TEST_ASSERT_EQUAL_INT32((int32_t)(uint32_t)p->old.run[k].level, p->state.run[k].level);
        TEST_ASSERT_EQUAL_UINT16(p->old.run[k].end, p->state.run[k].end);
        TEST_ASSERT_EQUAL_INT8(p->old.run[k].side, p->state.run[k].side);
    }
    TEST_ASSERT_EQUAL_INT32(run_bank_output(&p->bank, &p->old), hyst_pi_output(&p->model, &p->state));
}

/* A goal beside the position that the bank has at one of its corners. */
static hyst_q31_t beside_a_corner(const pair_t *p) {
    run_bank_state_t there = p->old;
    if (p->model.operators == 0) {
        return random_q31(&rng);
    }
    const uint32_t i = (uint32_t)(random_bits(&rng) % p->model.operators);
    const hyst_q31_t a = hyst_add(p->model.threshold[i], p->state.growth);
    const hyst_q31_t memory = run_bank_memory(&p->bank, &p->old, i);
    run_bank_advance(&p->bank, &there, random_unit(&rng) < 0.5 ? hyst_add(memory, a) : hyst_subtract(memory, a));
    return hyst_add(run_bank_output(&p->bank, &there), random_between(&rng, -2, 2));
}

static hyst_q31_t any_goal(const pair_t *p, double *swing) {
    const double kind = random_unit(&rng);
    const hyst_q31_t here = run_bank_output(&p->bank, &p->old);
    if (kind < 0.3) {
        *swing = -*swing * (random_unit(&rng) < 0.02 ? -40.0 : 0.5 + 0.5 * random_unit(&rng));
        *swing = *swing > 0x1p31 || *swing < -0x1p31 ? 0x1p30 : *swing;
        return hyst_saturate((int64_t)*swing);
    }
    if (kind < 0.5) {
        return beside_a_corner(p);
    }
    if (kind < 0.7) {
        return hyst_add(here, random_between(&rng, -3, 3));
    }
    if (kind < 0.85) {
        return hyst_add(here, random_q31(&rng) >> (random_bits(&rng) % 31U));
    }
    return kind < 0.9 ? (kind < 0.875 ? INT32_MIN : INT32_MAX) : random_q31(&rng);
}

static hyst_q31_t applied(const pair_t *p, hyst_q31_t solved) {
    const double kind = random_unit(&rng);
    if (kind < 0.6) {
        return solved;
    }
    if (kind < 0.7) {
        return hyst_add(solved, random_between(&rng, -1, 1));
    }
    if (kind < 0.8) {
        return hyst_clamp(solved, -(1 << 29), 1 << 29);
    }
    return kind < 0.85 ? p->state.drive : kind < 0.9 ? (kind < 0.875 ? INT32_MIN : INT32_MAX) : random_q31(&rng);
}

static void sample(pair_t *p, double *swing) {
    const hyst_q31_t goal = any_goal(p, swing);
    bool expected = false;
    hyst_pi_found_t found;
    const hyst_q31_t drive = hyst_pi_find(&p->model, &p->state, goal, &found);
    TEST_ASSERT_EQUAL_INT32(run_bank_solve(&p->bank, &p->old, goal, &expected), drive);
    TEST_ASSERT_EQUAL_INT(expected, found.unreachable);
    saturated_count += found.unreachable ? 1U : 0U;
    const hyst_q31_t next = applied(p, drive);
    if (random_unit(&rng) < 0.9) {
        const bool open = hyst_pi_leaves_open(&found);
        followed += next == drive && found.outward != 0 && !open ? 1U : 0U;
        searched += next != drive || open ? 1U : 0U;
        hyst_pi_follow(&p->model, &p->state, next, &found);
    } else {
        hyst_pi_advance(&p->model, &p->state, next);
    }
    run_bank_advance(&p->bank, &p->old, next);
    expect_same(p);
}

static void carry_to(pair_t *p, const pi_arguments_t *a) {
    pair_t to = {.model = pi_accept(a)};
    to.bank = run_bank_of(&to.model);
    uint32_t expected = 0;
    uint32_t got = 0;
    bool done = false;
    while (!done) {
        done = hyst_pi_carry(&p->model, &p->state, &to.model, &to.state, &got);
        TEST_ASSERT_EQUAL_INT(run_bank_carry(&p->bank, &p->old, &to.bank, &to.old, &expected), done);
        TEST_ASSERT_EQUAL_UINT32(expected, got);
        if (!done) { /* a sample in between */
            const hyst_q31_t drive = random_q31(&rng) >> (random_bits(&rng) % 31U);
            hyst_pi_advance(&p->model, &p->state, drive);
            run_bank_advance(&p->bank, &p->old, drive);
        }
    }
    carried_count++;
    *p = to;
    expect_same(p);
}

static void test_equals_the_bank_without_keys(void) {
    for (int run = 0; run < 600; run++) {
        static pair_t p;
        const pi_arguments_t a = any_model();
        p.model = pi_accept(&a);
        p.bank = run_bank_of(&p.model);
        const hyst_q31_t start = random_q31(&rng);
        hyst_pi_reset(&p.model, &p.state, start);
        run_bank_reset(&p.bank, &p.old, start);
        expect_same(&p);
        double swing = 0x1p31;
        for (int k = 0; k < 2000; k++) {
            sample(&p, &swing);
            if (random_unit(&rng) < 0.002) {
                const pi_arguments_t b = any_model();
                carry_to(&p, &b);
            }
        }
    }
    printf("%" PRIu64 " samples followed, %" PRIu64 " searched anew, %" PRIu64 " goals out of reach, %" PRIu64
           " memories carried over\n",
           followed, searched, saturated_count, carried_count);
    TEST_ASSERT_TRUE(followed > 100000 && searched > 100000 && saturated_count > 10000 && carried_count > 1000);
}

int main(void) {
    rng = random_start("test_bank_runs", 20261123);
    UNITY_BEGIN();
    RUN_TEST(test_equals_the_bank_without_keys);
    return UNITY_END();
}
