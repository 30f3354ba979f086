/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What record --probe plays, looked at from outside: the corners alone. */
#include "amplifier/probe_plan.h"
#include "chain/catalogue.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static random_t rng;
static failure_t failure;
static probe_plan_t plan;

void setUp(void) {
}
void tearDown(void) {
}

static const probe_limits_t usual = {
    .range_v = {-20.0, 130.0}, .slew_v_per_s = 7500.0, .sample_rate_hz = 10000.0, .decimation = 10, .lead = 0};

static double span_v(const probe_limits_t *limits) {
    return limits->range_v[1] - limits->range_v[0];
}

/* In range, not too steep, corners on frames, nothing dropped for want of room, and over the whole range at first. */
static void expect_playable(unsigned parts, const probe_limits_t *limits) {
    double samples = 0.0, level = 0.5 * (limits->range_v[0] + limits->range_v[1]), low = HUGE_VAL, high = -HUGE_VAL;
    probe_plan_make(&plan, parts, limits);
    TEST_ASSERT_LESS_THAN_UINT(PROBE_PLAN_MAX_CORNERS, plan.corners);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * span_v(limits), level, plan.start_v);
    for (size_t i = 0; i < plan.corners; i++) {
        const breakpoint_t *corner = &plan.corner[i];
        samples += corner->samples;
        TEST_ASSERT_GREATER_THAN_UINT32(0, corner->samples);
        /* frame k is sample 1 + lead + k * decimation of what is played */
        TEST_ASSERT_TRUE(fmod(samples - 1.0 - (double)limits->lead, (double)limits->decimation) == 0.0);
        const double seconds = corner->samples / limits->sample_rate_hz;
        TEST_ASSERT_TRUE(fabs(corner->level - level) <= limits->slew_v_per_s * seconds * (1.0 + 2e-6));
        level = corner->level;
        low = fmin(low, level);
        high = fmax(high, level);
        TEST_ASSERT_TRUE(level >= limits->range_v[0] - 1e-9 * span_v(limits));
        TEST_ASSERT_TRUE(level <= limits->range_v[1] + 1e-9 * span_v(limits));
        if (i == 2) { /* the memory is determined first */
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, limits->range_v[0], low);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, limits->range_v[1], high);
        }
    }
    TEST_ASSERT_TRUE(samples == plan.samples);
}

static void test_every_block_that_is_looked_for_has_parts(void) {
    unsigned all = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        const unsigned parts = probe_parts(block->name, &failure);
        if (block->probe == NULL) {
            TEST_ASSERT_EQUAL_UINT_MESSAGE(0, parts, block->name);
            TEST_ASSERT_NOT_NULL(strstr(failure.text, block->name));
            TEST_ASSERT_NOT_NULL(strstr(failure.text, "diagnose does not look for this block; there are all, "));
            continue;
        }
        TEST_ASSERT_GREATER_THAN_UINT_MESSAGE(0, parts, block->name);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(0, parts & ~(unsigned)PROBE_EVERYTHING, block->name);
        expect_playable(parts, &usual);
        all |= parts;
    }
    TEST_ASSERT_EQUAL_UINT(PROBE_EVERYTHING, all); /* no part that nobody needs */
}

/* The answer to a wrong name has every right one, to the last. */
static void test_no_such_block_lists_them(void) {
    TEST_ASSERT_EQUAL_UINT(0, probe_parts("crep", &failure));
    TEST_ASSERT_EQUAL_UINT(0, probe_parts("", &failure));
    TEST_ASSERT_NOT_NULL(strstr(failure.text, "no such block"));
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->probe != NULL) {
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, catalogue[i]->name), catalogue[i]->name);
        }
    }
}

/* What the help promises of "all"; a block's probe is shorter. */
static void test_lengths(void) {
    probe_plan_make(&plan, PROBE_EVERYTHING, &usual);
    const double all_s = plan.samples / usual.sample_rate_hz;
    printf("all: %.2f s, %zu corners\n", all_s, plan.corners);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 25.0, all_s);
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->probe != NULL) {
            probe_plan_make(&plan, catalogue[i]->probe->parts, &usual);
            const double seconds = plan.samples / usual.sample_rate_hz;
            printf("%s: %.2f s, %zu corners\n", catalogue[i]->name, seconds, plan.corners);
            TEST_ASSERT_TRUE(seconds > 3.0 && seconds < all_s - 1.0);
        }
    }
}

/* Each part is there if and only if requested: alone it makes the plan longer, and the text says so. */
static void test_each_part_adds_to_the_plan(void) {
    char text[200];
    probe_plan_make(&plan, 0, &usual);
    const double least = plan.samples;
    probe_plan_describe(&plan, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("sweep, slow triangle", text);
    for (unsigned part = 1; part < (unsigned)PROBE_EVERYTHING; part <<= 1) {
        probe_plan_make(&plan, part, &usual);
        TEST_ASSERT_TRUE(plan.samples > least);
        probe_plan_describe(&plan, text, sizeof text);
        TEST_ASSERT_EQUAL_MEMORY("sweep, slow triangle, ", text, 22);
    }
    probe_plan_make(&plan, PROBE_EVERYTHING, &usual);
    probe_plan_describe(&plan, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("sweep, slow triangle, silence, staircase, fast triangle, chirps, burst, ladder, loops, "
                             "return",
                             text);
}

/* The holds that creep needs, at levels that are reached from both sides. */
static void test_the_staircase_returns_to_its_levels(void) {
    unsigned from_below = 0, from_above = 0;
    probe_plan_make(&plan, PROBE_STAIRCASE, &usual);
    for (size_t i = 2; i < plan.corners; i++) {
        const double level = plan.corner[i].level;
        if (plan.corner[i].samples >= 15000 && plan.corner[i - 1].level == level &&
            fabs(level - (usual.range_v[0] + 0.55 * span_v(&usual))) < 1e-9) {
            from_below += plan.corner[i - 2].level < level ? 1U : 0U;
            from_above += plan.corner[i - 2].level > level ? 1U : 0U;
        }
    }
    TEST_ASSERT_EQUAL_UINT(1, from_below);
    TEST_ASSERT_EQUAL_UINT(1, from_above);
}

/* Half periods get shorter, from half a second to what the limits allow, and the time stays what it should be. */
static void test_a_chirp_rises(void) {
    size_t ends = 0;
    uint32_t shortest = UINT32_MAX;
    probe_plan_make(&plan, 0, &usual);
    const double without = plan.samples;
    probe_plan_make(&plan, PROBE_CHIRPS, &usual);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 3.0, (plan.samples - without) / usual.sample_rate_hz);
    for (size_t i = 1; i < plan.corners; i++) {
        const double level = plan.corner[i].level;
        if (fabs(fabs(level - 55.0) - 0.025 * span_v(&usual)) < 1e-9 && level != plan.corner[i - 1].level) {
            ends++;
            shortest = plan.corner[i].samples < shortest ? plan.corner[i].samples : shortest;
            TEST_ASSERT_TRUE(plan.corner[i + 1].level == level); /* flat for one frame */
            TEST_ASSERT_EQUAL_UINT32(usual.decimation, plan.corner[i + 1].samples);
        }
    }
    /* 5 frames and the flat one: up to 83 Hz. Turns in 1.5 s: 82 / ln(83) * 1.5 = 28. */
    TEST_ASSERT_EQUAL_UINT32(50, shortest);
    TEST_ASSERT_UINT_WITHIN(2, 56, ends);
}

static void test_any_limits(void) {
    for (int i = 0; i < 500; i++) {
        const double low_v = 200.0 * (2.0 * random_unit(&rng) - 1.0), width_v = 1.0 + 500.0 * random_unit(&rng);
        const probe_limits_t limits = {.range_v = {low_v, low_v + width_v},
                                       .slew_v_per_s = width_v / PROBE_PLAN_SLOWEST_S * pow(1000.0, random_unit(&rng)),
                                       .sample_rate_hz = 1000.0 * pow(100.0, random_unit(&rng)),
                                       .decimation = (unsigned long)random_between(&rng, 1, 40),
                                       .lead = (unsigned long)random_between(&rng, 0, 64)};
        expect_playable((unsigned)random_between(&rng, 0, (int32_t)PROBE_EVERYTHING), &limits);
    }
}

int main(void) {
    rng = random_start("probe_plan", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_every_block_that_is_looked_for_has_parts);
    RUN_TEST(test_no_such_block_lists_them);
    RUN_TEST(test_lengths);
    RUN_TEST(test_each_part_adds_to_the_plan);
    RUN_TEST(test_the_staircase_returns_to_its_levels);
    RUN_TEST(test_a_chirp_rises);
    RUN_TEST(test_any_limits);
    return UNITY_END();
}
