/* SPDX-License-Identifier: MIT */
/* Memory carried over to other models: where it ends up, in portions with samples in between as well as at once. */
#include "hyst/parameters.h"
#include "models.h"
#include "preisach_models.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static uint32_t any_count(void) {
    static const uint32_t sizes[] = {0, 1, 2, 10, 64, HYST_PI_MAX_OPERATORS};
    return random_unit(&rng) < 0.5 ? sizes[random_bits(&rng) % (sizeof sizes / sizeof sizes[0])]
                                   : (uint32_t)(random_bits(&rng) % (HYST_PI_MAX_OPERATORS + 1U));
}

/* Thresholds as far apart as they can be: every other reversal peels off one operator. */
static pi_arguments_t even(uint32_t operators) {
    pi_arguments_t a = pi_random(&rng, operators, false);
    for (uint32_t i = 0; i < operators; i++) {
        a.threshold[i] = (hyst_q31_t)((int64_t)HYST_Q31_MAX * (i + 1U) / (operators + 1U));
    }
    return a;
}

/* Reversals each of which leaves one more operator of an even bank behind: as many runs as operators. */
static void peel(const hyst_pi_t *model, hyst_pi_state_t *state) {
    const int64_t n = model->operators;
    for (int64_t k = n; k >= 0; k--) {
        const int64_t amplitude = HYST_Q31_MAX * (4 * k + 1) / (4 * n + 4);
        hyst_pi_advance(model, state, (hyst_q31_t)(k % 2 == 0 ? amplitude : -amplitude));
    }
}

/*
 * What the memory may do next: nest one reversal more, a step in the same direction, one unit, wipe out inner loops of
 * any depth, everything, or rest.
 */
static hyst_q31_t next_drive(hyst_q31_t last, double *swing) {
    const double kind = random_unit(&rng);
    if (kind < 0.6) {
        *swing = -*swing * (1.0 - 0.05 * random_unit(&rng));
    } else if (kind < 0.7) {
        return hyst_add(last, random_q31(&rng) / 512);
    } else if (kind < 0.75) {
        return hyst_add(last, random_unit(&rng) < 0.5 ? 1 : -1);
    } else if (kind < 0.8) {
        return last;
    } else if (kind < 0.81) {
        *swing = -*swing / (0.02 + random_unit(&rng));
    } else if (kind < 0.812) {
        *swing = random_unit(&rng) < 0.5 ? 0x1p31 : -0x1p31;
    }
    *swing = *swing > 0x1p31 ? 0x1p31 : *swing < -0x1p31 ? -0x1p31 : *swing;
    return hyst_saturate((int64_t)*swing);
}

static void test_carry_keeps_equal_thresholds_and_nests_others(void) {
    for (int run = 0; run < 2000; run++) {
        const pi_arguments_t a = pi_random(&rng, any_count(), run % 2 == 0);
        const hyst_pi_t from = pi_accept(&a);
        hyst_pi_state_t state;
        hyst_pi_reset(&from, &state, 0);
        for (int k = 0; k < 30; k++) {
            hyst_pi_advance(&from, &state, random_q31(&rng));
        }
        hyst_pi_state_t same;
        pi_carry(&from, &state, &from, &same);
        TEST_ASSERT_EQUAL_INT32(state.drive, same.drive);
        for (uint32_t i = 0; i < from.operators; i++) {
            TEST_ASSERT_EQUAL_INT32(hyst_pi_memory(&from, &state, i), hyst_pi_memory(&from, &same, i));
        }
        const pi_arguments_t b = pi_random(&rng, 1 + (uint32_t)(random_bits(&rng) % HYST_PI_MAX_OPERATORS), false);
        const hyst_pi_t to = pi_accept(&b);
        hyst_pi_state_t carried;
        pi_carry(&from, &state, &to, &carried);
        for (uint32_t i = 1; i < to.operators; i++) {
            TEST_ASSERT_TRUE(llabs((int64_t)hyst_pi_memory(&to, &carried, i) - hyst_pi_memory(&to, &carried, i - 1)) <=
                             (int64_t)to.threshold[i] - to.threshold[i - 1]);
        }
    }
}

/* New operators between the old ones leave the old ones' memory alone, to the bit. */
static void test_carry_to_a_finer_bank_keeps_the_common_thresholds(void) {
    for (int run = 0; run < 500; run++) {
        const pi_arguments_t a = pi_random(&rng, 1 + (uint32_t)(random_bits(&rng) % 100U), run % 2 == 0);
        pi_arguments_t fine = pi_random(&rng, 2 * a.operators, false);
        for (uint32_t i = 0; i < a.operators; i++) {
            const hyst_q31_t before = i > 0 ? a.threshold[i - 1] : 0;
            fine.threshold[2 * i] = before + (a.threshold[i] - before) / 2;
            fine.threshold[2 * i + 1] = a.threshold[i];
        }
        const hyst_pi_t from = pi_accept(&a);
        const hyst_pi_t to = pi_accept(&fine);
        hyst_pi_state_t state, carried;
        hyst_pi_reset(&from, &state, random_q31(&rng));
        for (int k = 0; k < 100; k++) {
            hyst_pi_advance(&from, &state, random_unit(&rng) < 0.3 ? random_q31(&rng) : random_q31(&rng) / (k + 1));
            pi_carry(&from, &state, &to, &carried);
            for (uint32_t i = 0; i < a.operators; i++) {
                TEST_ASSERT_EQUAL_INT32(hyst_pi_memory(&from, &state, i), hyst_pi_memory(&to, &carried, 2 * i + 1));
            }
            TEST_ASSERT_TRUE(carried.runs <= 2 * state.runs + 3); /* what the cost rests on */
        }
    }
}

/* Two models and a history of the first. Every third is as deep as its operators allow, the very first 256 runs. */
typedef struct {
    hyst_pi_t from, to;
    hyst_pi_state_t state;
    double swing;
} case_t;

static case_t any_case(int run) {
    const bool deep = run % 3 == 0;
    const uint32_t operators = run == 0 ? HYST_PI_MAX_OPERATORS : any_count();
    const pi_arguments_t a = deep ? even(operators) : pi_random(&rng, operators, run % 2 == 0);
    const pi_arguments_t b = run % 4 == 0 ? even(any_count()) : pi_random(&rng, any_count(), run % 5 == 0);
    case_t c = {.from = pi_accept(&a), .to = pi_accept(&b), .swing = 0x1p31};
    hyst_pi_reset(&c.from, &c.state, random_q31(&rng));
    if (deep) {
        peel(&c.from, &c.state);
        c.swing = c.state.drive;
    }
    for (uint64_t k = run == 0 ? 0U : random_bits(&rng) % 300U; k > 0; k--) {
        hyst_pi_advance(&c.from, &c.state, next_drive(c.state.drive, &c.swing));
    }
    return c;
}

/* The run that operator i belongs to. */
static const hyst_pi_run_t *run_with(const hyst_pi_state_t *state, uint32_t i) {
    uint32_t k = 0;
    while (k + 1U < state->runs && state->run[k + 1U].end > i) {
        k++;
    }
    return &state->run[k];
}

static int64_t within(int64_t x, int64_t middle, int64_t distance) {
    return x > middle + distance ? middle + distance : x < middle - distance ? middle - distance : x;
}

/* The memory curve at a threshold, from what hyst_pi_carry promises, for one threshold alone. */
static int64_t curve_at(const hyst_pi_t *from, const hyst_pi_state_t *state, hyst_q31_t threshold) {
    uint32_t i = 0; /* the first old operator that is not inside */
    while (i < from->operators && from->threshold[i] < threshold) {
        i++;
    }
    if (from->operators == 0) {
        return state->drive;
    }
    if (i == from->operators) { /* the last one's value, as far as |z| + a <= 1 lets it be */
        const int64_t last = hyst_pi_memory(from, state, i - 1U);
        return last >= 0 ? (last < HYST_Q31_MAX - (int64_t)threshold ? last : HYST_Q31_MAX - (int64_t)threshold)
                         : (last > HYST_Q31_MIN + (int64_t)threshold ? last : HYST_Q31_MIN + (int64_t)threshold);
    }
    int64_t continued = state->drive; /* the line of the next inner operator, outwards */
    if (i > 0) {
        const hyst_pi_run_t *run = run_with(state, i - 1U);
        const uint32_t last = run->end - 1U;
        continued =
            hyst_pi_memory(from, state, last) + run->side * ((int64_t)threshold - (int64_t)from->threshold[last]);
    }
    return within(continued, hyst_pi_memory(from, state, i), (int64_t)from->threshold[i] - threshold);
}

static void test_every_operator_reads_the_memory_curve(void) {
    uint32_t most = 0;
    for (int run = 0; run < 600; run++) {
        const case_t c = any_case(run);
        most = c.state.runs > most ? c.state.runs : most;
        hyst_pi_state_t carried;
        pi_carry(&c.from, &c.state, &c.to, &carried);
        TEST_ASSERT_EQUAL_INT32(c.state.drive, carried.drive);
        for (uint32_t i = 0; i < c.to.operators; i++) {
            TEST_ASSERT_EQUAL_INT32(curve_at(&c.from, &c.state, c.to.threshold[i]), hyst_pi_memory(&c.to, &carried, i));
        }
    }
    TEST_ASSERT_EQUAL_UINT32(HYST_PI_MAX_OPERATORS, most);
}

static void expect_same_memory(const hyst_pi_state_t *expected, const hyst_pi_state_t *got) {
    TEST_ASSERT_EQUAL_UINT32(expected->runs, got->runs);
    TEST_ASSERT_EQUAL_INT32(expected->drive, got->drive);
    TEST_ASSERT_EQUAL_INT32(expected->rate, got->rate);
    for (uint32_t k = 0; k < expected->runs; k++) {
        TEST_ASSERT_EQUAL_INT32(expected->run[k].level, got->run[k].level);
        for (int way = HYST_PI_DOWN; way <= HYST_PI_UP; way++) {
            TEST_ASSERT_EQUAL_INT64(expected->run[k].response[way], got->run[k].response[way]);
            TEST_ASSERT_EQUAL_INT32(expected->run[k].corner[way], got->run[k].corner[way]);
        }
        TEST_ASSERT_EQUAL_UINT16(expected->run[k].end, got->run[k].end);
        TEST_ASSERT_EQUAL_INT8(expected->run[k].side, got->run[k].side);
    }
}

/* One portion a sample, while the old memory grows, shrinks and forgets everything: as if all were carried at the end.
 */
static void test_portions_between_samples_are_the_whole(void) {
    uint32_t longest = 0;
    for (int run = 0; run < 1500; run++) {
        case_t c = any_case(run);
        hyst_pi_state_t portions, whole;
        uint32_t carried = 0;
        uint32_t calls = 1;
        while (!hyst_pi_carry(&c.from, &c.state, &c.to, &portions, &carried)) {
            calls++;
            hyst_pi_advance(&c.from, &c.state, next_drive(c.state.drive, &c.swing));
        }
        longest = calls > longest ? calls : longest;
        pi_carry(&c.from, &c.state, &c.to, &whole);
        expect_same_memory(&whole, &portions);
    }
    printf("at most %" PRIu32 " calls\n", longest);
    TEST_ASSERT_TRUE(longest <= HYST_PI_CARRY_CALLS);
    TEST_ASSERT_TRUE(longest > HYST_PI_CARRY_CALLS / 4); /* else the histories were too short to show anything */
}

/* Every number of portions, and after it a sample that leaves any number of runs: down to the middle of what has been
 * carried, and of what has not. */
static void test_a_memory_that_is_wiped_out_under_way(void) {
    const pi_arguments_t a = even(HYST_PI_MAX_OPERATORS);
    const hyst_pi_t from = pi_accept(&a);
    for (uint32_t portions = 1; portions < HYST_PI_CARRY_CALLS; portions++) {
        const pi_arguments_t b = pi_random(&rng, 1U + any_count() / 2U, false);
        const hyst_pi_t to = pi_accept(&b);
        for (uint32_t left = 0; left <= HYST_PI_MAX_OPERATORS; left += 5U) {
            hyst_pi_state_t state, got, whole;
            hyst_pi_reset(&from, &state, 0);
            peel(&from, &state);
            TEST_ASSERT_EQUAL_UINT32(HYST_PI_MAX_OPERATORS, state.runs);
            uint32_t carried = 0;
            for (uint32_t k = 0; k < portions; k++) {
                TEST_ASSERT_FALSE(hyst_pi_carry(&from, &state, &to, &got, &carried));
            }
            const double reached = 0x1p31 * (1.0 - left / (HYST_PI_MAX_OPERATORS + 1.0)) * 0.999;
            hyst_pi_advance(&from, &state, (hyst_q31_t)(random_unit(&rng) < 0.5 ? reached : -reached));
            while (!hyst_pi_carry(&from, &state, &to, &got, &carried)) {
            }
            pi_carry(&from, &state, &to, &whole);
            expect_same_memory(&whole, &got);
        }
    }
}

static hyst_compensator_t compensator_with(const pi_arguments_t *a) {
    hyst_parameters_t p;
    hyst_compensator_t c;
    hyst_parameters_default(&p);
    p.pi_operators = a->operators;
    memcpy(p.pi_weight, a->weight, sizeof p.pi_weight);
    memcpy(p.pi_threshold, a->threshold, sizeof p.pi_threshold);
    p.transition_slew = 1 << 20;
    p.creep_cells = (uint32_t)(random_bits(&rng) % 2U);
    p.creep[0] = (hyst_creep_cell_t){.gain = HYST_Q31_MAX / 50, .rate = HYST_Q31_MAX / 100};
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&p, &c).error);
    return c;
}

/*
 * The pipeline under motion: while portions are carried it does what it does without an adoption, and from then on what
 * it does after an adoption in one piece.
 */
static void test_a_pipeline_that_adopts_under_motion(void) {
    uint32_t longest = 0;
    for (int run = 0; run < 100; run++) {
        const pi_arguments_t a = even(run == 0 ? HYST_PI_MAX_OPERATORS : any_count());
        const pi_arguments_t b = even(any_count());
        const hyst_compensator_t from = compensator_with(&a);
        const hyst_compensator_t to = compensator_with(&b);
        unsigned events;
        hyst_compensator_state_t s, undisturbed, whole;
        hyst_compensator_reset(&from, &s);
        for (int k = 0; k < 100; k++) { /* some transition is left of the change of mode */
            (void)hyst_compensator_step(&from, &s, HYST_MODE_COMPENSATE, 0, &events);
        }
        peel(&from.hysteresis.prandtl_ishlinskii, &hyst_compensator_memory(&s)->prandtl_ishlinskii);
        undisturbed = s;
        uint32_t calls = 1;
        for (;; calls++) {
            whole = s;
            whole.carried = 0;
            if (hyst_compensator_adopt(&from, &to, &s)) {
                break;
            }
            const hyst_q31_t reference = random_q31(&rng) / 256;
            const hyst_q31_t drive = hyst_compensator_step(&from, &s, HYST_MODE_COMPENSATE, reference, &events);
            TEST_ASSERT_EQUAL_INT32(
                hyst_compensator_step(&from, &undisturbed, HYST_MODE_COMPENSATE, reference, &events), drive);
        }
        longest = calls > longest ? calls : longest;
        while (!hyst_compensator_adopt(&from, &to, &whole)) {
        }
        const hyst_q31_t last = s.drive;
        expect_same_memory(&hyst_compensator_memory(&whole)->prandtl_ishlinskii,
                           &hyst_compensator_memory(&s)->prandtl_ishlinskii);
        for (int k = 0; k < 200; k++) {
            const hyst_q31_t reference = random_q31(&rng) / 4;
            const hyst_q31_t drive = hyst_compensator_step(&to, &s, HYST_MODE_COMPENSATE, reference, &events);
            TEST_ASSERT_EQUAL_INT32(hyst_compensator_step(&to, &whole, HYST_MODE_COMPENSATE, reference, &events),
                                    drive);
            TEST_ASSERT_TRUE_MESSAGE(k > 0 || drive == last, "the first sample repeats the drive");
        }
    }
    printf("a pipeline adopted within %" PRIu32 " samples at most\n", longest);
    TEST_ASSERT_TRUE(longest > HYST_PI_CARRY_CALLS / 2 && longest <= HYST_PI_CARRY_CALLS);
}

/* A full stack, merged under way wherever the smallest gap is. */
static void test_portions_of_a_preisach_memory(void) {
    uint32_t longest = 0;
    int full = 0;
    for (int run = 0; run < 4000; run++) {
        const preisach_arguments_t a = preisach_random(&rng, 1U + (uint32_t)(random_bits(&rng) % 30U));
        const preisach_arguments_t b = preisach_random(&rng, 1U + (uint32_t)(random_bits(&rng) % 30U));
        const hyst_preisach_t from = preisach_accept(&a);
        const hyst_preisach_t to = preisach_accept(&b);
        hyst_preisach_state_t state, portions, whole;
        hyst_preisach_reset(&from, &state, random_q31(&rng));
        double swing = 0x1p31;
        /* Gaps that grow inwards make the merging begin at the outer end, gaps that shrink at the inner one. */
        const double growth = 0.9 + 0.2 * random_unit(&rng);
        double gap = growth > 1.0 ? 0x1p18 : 0x1p26;
        for (uint64_t k = 60U + random_bits(&rng) % 100U; k > 0; k--) {
            hyst_preisach_advance(&from, &state, hyst_saturate((int64_t)swing));
            swing += swing > 0.0 ? -gap : gap;
            swing = -swing;
            gap *= growth;
        }
        uint32_t carried = 0;
        uint32_t calls = 1;
        full += state.extremes >= HYST_PREISACH_MAX_EXTREMES - 1 ? 1 : 0;
        while (!hyst_preisach_carry(&from, &state, &to, &portions, &carried)) {
            calls++;
            const bool inwards = random_unit(&rng) < 0.8;
            hyst_preisach_advance(&from, &state,
                                  inwards
                                      ? (hyst_q31_t)(state.extreme[state.extremes - 1U].drive / 2 + state.now.drive / 2)
                                      : next_drive(state.now.drive, &swing));
        }
        longest = calls > longest ? calls : longest;
        preisach_carry(&from, &state, &to, &whole);
        TEST_ASSERT_EQUAL_UINT32(whole.extremes, portions.extremes);
        TEST_ASSERT_EQUAL_INT32(whole.now.drive, portions.now.drive);
        TEST_ASSERT_EQUAL_INT64(whole.now.output, portions.now.output);
        for (uint32_t k = 0; k < whole.extremes; k++) {
            TEST_ASSERT_EQUAL_INT32(whole.extreme[k].drive, portions.extreme[k].drive);
            TEST_ASSERT_EQUAL_INT64(whole.extreme[k].output, portions.extreme[k].output);
        }
    }
    printf("%d of 4000 Preisach memories full, at most %" PRIu32 " calls\n", full, longest);
    TEST_ASSERT_TRUE(full > 1000);
    TEST_ASSERT_EQUAL_UINT32(HYST_PREISACH_CARRY_CALLS, longest); /* the bound, and that it is met: merged under way */
}

int main(void) {
    rng = random_start("test_carry", 20261122);
    UNITY_BEGIN();
    RUN_TEST(test_carry_keeps_equal_thresholds_and_nests_others);
    RUN_TEST(test_carry_to_a_finer_bank_keeps_the_common_thresholds);
    RUN_TEST(test_every_operator_reads_the_memory_curve);
    RUN_TEST(test_portions_between_samples_are_the_whole);
    RUN_TEST(test_a_memory_that_is_wiped_out_under_way);
    RUN_TEST(test_a_pipeline_that_adopts_under_motion);
    RUN_TEST(test_portions_of_a_preisach_memory);
    return UNITY_END();
}
