/* SPDX-License-Identifier: MIT */
/* What the modified play model refuses, and that it is right to: the refused models misbehave. */
#include "modified_play_models.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static void expect(hyst_modified_play_status_t status, const hyst_modified_play_parameters_t *p, uint32_t at) {
    hyst_modified_play_t model;
    memset(&model, 0x5A, sizeof model);
    const hyst_modified_play_t before = model;
    uint32_t element = 99;
    TEST_ASSERT_EQUAL_INT(status, hyst_modified_play_build(&model, p, &element));
    TEST_ASSERT_EQUAL_UINT32(at, element);
    if (status != HYST_MODIFIED_PLAY_OK) {
        TEST_ASSERT_EQUAL_MEMORY(&before, &model, sizeof model);
    }
}

static void test_sizes(void) {
    const hyst_modified_play_parameters_t good = modified_play_plain(0.5, 0.02);
    expect(HYST_MODIFIED_PLAY_OK, &good, 0);
    hyst_modified_play_parameters_t p = good;
    p.divisions = 0;
    expect(HYST_MODIFIED_PLAY_DIVISIONS_OUT_OF_RANGE, &p, 0);
    p.divisions = HYST_MODIFIED_PLAY_MAX_DIVISIONS + 1;
    expect(HYST_MODIFIED_PLAY_DIVISIONS_OUT_OF_RANGE, &p, 0);
    p = good;
    p.sine[0] = p.cosine[2] = HYST_Q28_ONE / 2 + 1;
    expect(HYST_MODIFIED_PLAY_COEFFICIENTS_TOO_LARGE, &p, 0);
    p = good;
    p.feedback[1] = p.feedback[2] = INT32_MIN; /* a magnitude that 32 bits do not have */
    expect(HYST_MODIFIED_PLAY_COEFFICIENTS_TOO_LARGE, &p, 0);
    p = good;
    p.slope[44] = INT32_MIN; /* 8 * pitch = 0.8, the others 44 * 0.002 */
    expect(HYST_MODIFIED_PLAY_TOO_FLAT, &p, 44);
    p = good;
    p.divisions = 2;
    p.direct = 4 * HYST_Q28_ONE;
    p.slope[0] = -(hyst_q28_t)(3.9 * HYST_Q28_ONE);
    expect(HYST_MODIFIED_PLAY_OK, &p, 0); /* omega = 1.95 */
    p.slope[0] = INT32_MIN;
    expect(HYST_MODIFIED_PLAY_WEIGHTS_TOO_LARGE, &p, 0);
    p = good;
    p.direct = (hyst_q28_t)HYST_MODIFIED_PLAY_MAX_SLOPE;
    expect(HYST_MODIFIED_PLAY_TOO_STEEP, &p, 0); /* with row 1 on top: its first cell */
    p.direct = HYST_MODIFIED_PLAY_MIN_SLOPE - 1;
    expect(HYST_MODIFIED_PLAY_TOO_FLAT, &p, 0);
}

static void test_rates(void) {
    const hyst_modified_play_parameters_t good = modified_play_plain(0.5, 0.02);
    hyst_modified_play_parameters_t p = good;
    p.alpha = -1;
    expect(HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE, &p, 0);
    p = good;
    p.beta = -1;
    expect(HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE, &p, 0);
    p = good;
    p.rate_gain = 0; /* not looked at without alpha and beta */
    expect(HYST_MODIFIED_PLAY_OK, &p, 0);
    p.beta = 1;
    expect(HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE, &p, 0);
    p.rate_gain = HYST_Q30_ONE + 1;
    expect(HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE, &p, 0);
}

static void test_filter(void) {
    hyst_modified_play_parameters_t p = modified_play_plain(0.5, 0.02);
    static const struct {
        double c1, c2, c3;
        bool stable;
    } filters[] = {{0.99, 0.0, 0.0, true},        {1.01, 0.0, 0.0, false},  {-0.99, 0.0, 0.0, true},
                   {-1.01, 0.0, 0.0, false},      {0.0, 0.0, 0.99, true},   {0.0, 0.0, -1.01, false},
                   {1.8, -0.97, 0.0, true},       {1.8, -1.02, 0.0, false}, {2.91, -2.8227, 0.912673, true},
                   {2.91, -2.8227, 0.9128, false}}; /* the last two: a threefold pole at 0.97, and beside it */
    for (size_t i = 0; i < sizeof filters / sizeof filters[0]; i++) {
        p.feedback[0] = (hyst_q28_t)lround(filters[i].c1 * HYST_Q28_ONE);
        p.feedback[1] = (hyst_q28_t)lround(filters[i].c2 * HYST_Q28_ONE);
        p.feedback[2] = (hyst_q28_t)lround(filters[i].c3 * HYST_Q28_ONE);
        expect(filters[i].stable ? HYST_MODIFIED_PLAY_OK : HYST_MODIFIED_PLAY_FILTER_UNSTABLE, &p, 0);
    }
    /* g u moves c1: at the ends of the drive 0.7 -+ 0.32 is beyond 1. */
    p = modified_play_plain(0.5, 0.02);
    p.feedback[0] = (hyst_q28_t)(0.7 * HYST_Q28_ONE);
    p.bilinear = (hyst_q28_t)(0.28 * HYST_Q28_ONE);
    expect(HYST_MODIFIED_PLAY_OK, &p, 0);
    p.bilinear = -(hyst_q28_t)(0.32 * HYST_Q28_ONE);
    expect(HYST_MODIFIED_PLAY_FILTER_UNSTABLE, &p, 0);
}

/* Jury's conditions against the poles themselves: 1000 random triples near the edge of stability. */
static void test_filter_against_its_poles(void) {
    int stable = 0;
    for (int run = 0; run < 1000; run++) {
        const double radius = 0.9 + 0.2 * random_unit(&rng);
        const double twice = 2.0 * radius * cos(3.14 * random_unit(&rng));
        const double pole = 2.2 * random_unit(&rng) - 1.1;
        if (fabs(radius - 1.0) < 1e-6 || fabs(fabs(pole) - 1.0) < 1e-6) {
            continue;
        }
        hyst_modified_play_parameters_t p = modified_play_plain(0.5, 0.02);
        p.feedback[0] = (hyst_q28_t)lround((pole + twice) * HYST_Q28_ONE);
        p.feedback[1] = (hyst_q28_t)lround(-(radius * radius + pole * twice) * HYST_Q28_ONE);
        p.feedback[2] = (hyst_q28_t)lround(pole * radius * radius * HYST_Q28_ONE);
        const bool inside = radius < 1.0 && fabs(pole) < 1.0;
        stable += inside ? 1 : 0;
        expect(inside ? HYST_MODIFIED_PLAY_OK : HYST_MODIFIED_PLAY_FILTER_UNSTABLE, &p, 0);
    }
    TEST_ASSERT_TRUE(stable > 300 && stable < 700);
}

/*
 * Every cell in turn is made so negative that a branch just falls: refused. A quarter less: accepted. With the cell of
 * row i and column j falling, the branch is rising with column i + j and rows 1..i moving, or falling with column j.
 */
static void test_each_cell_can_make_a_branch_fall(void) {
    const hyst_modified_play_parameters_t good = modified_play_plain(0.5, 0.02);
    uint32_t cell = 0;
    for (uint32_t row = 1; row < good.divisions; row++) {
        for (uint32_t j = 0; j < good.divisions - row; j++, cell++) {
            hyst_modified_play_parameters_t p = good;
            /* Rows 1..i-1 contribute where they have a cell in that column; the smaller sum decides. */
            uint32_t rising = 0;
            uint32_t falling = 0;
            for (uint32_t inner = 1; inner < row; inner++) {
                rising += inner <= row + j ? 1U : 0U;
                falling += j <= good.divisions - 1U - inner ? 1U : 0U;
            }
            const uint32_t fewest = rising < falling ? rising : falling;
            const double there = 0.5 + 0.02 * fewest;
            p.slope[cell] = (hyst_q28_t)lround(-there * HYST_Q28_ONE);
            expect(HYST_MODIFIED_PLAY_TOO_FLAT, &p, cell);
            p.slope[cell] = (hyst_q28_t)lround(-0.75 * there * HYST_Q28_ONE);
            expect(HYST_MODIFIED_PLAY_OK, &p, 0);
        }
    }
}

/* A refused branch really falls: in long double, the position goes down while the drive goes up. */
static void test_the_refused_branch_really_falls(void) {
    hyst_modified_play_parameters_t p = modified_play_plain(0.1, 0.0);
    p.slope[4] = -HYST_Q28_ONE / 5; /* row 1, the cell around p = 0 */
    expect(HYST_MODIFIED_PLAY_TOO_FLAT, &p, 4);
    reference_play_t reference = reference_play(&p);
    const long double before = reference_play_forward(&reference, 0.1L);
    TEST_ASSERT_TRUE(reference_play_forward(&reference, 0.15L) < before);
}

/* Reversals of the drive that the implicit inverse (in long double) makes of a position that is reached and held. */
static int reversals_while_held(const hyst_modified_play_parameters_t *p) {
    reference_play_t reference = reference_play(p);
    long double before = 0.0L;
    long double step = 0.0L;
    int reversals = 0;
    for (int k = 0; k < 600; k++) {
        const long double wanted = 0.95L * fminl(1.0L, k / 100.0L);
        const long double u = reference_play_inverse(&reference, wanted);
        if (k > 400) {
            reversals += fabsl(u - before) > 1e-6L && (u - before) * step < 0.0L ? 1 : 0;
        }
        step = u - before;
        before = u;
    }
    return reversals;
}

static void test_the_refused_feedback_really_rings(void) {
    hyst_modified_play_parameters_t p = modified_play_plain(0.6, 0.0);
    p.bilinear = (hyst_q28_t)(0.89 * 0.6 * HYST_Q28_ONE);
    expect(HYST_MODIFIED_PLAY_OK, &p, 0);
    const int accepted = reversals_while_held(&p);
    p.bilinear = (hyst_q28_t)(0.91 * 0.6 * HYST_Q28_ONE);
    expect(HYST_MODIFIED_PLAY_INVERSE_UNSTABLE, &p, 0);
    p.bilinear = (hyst_q28_t)(1.2 * 0.6 * HYST_Q28_ONE); /* L / S = 1.2, at this position 1.14 */
    expect(HYST_MODIFIED_PLAY_INVERSE_UNSTABLE, &p, 0);
    const int refused = reversals_while_held(&p);
    printf("position held for 200 samples: %d reversals with g = 0.89 * 2A, %d with 1.2 * 2A\n", accepted, refused);
    TEST_ASSERT_EQUAL_INT(0, accepted);
    TEST_ASSERT_TRUE(refused > 150);
    /* The harmonics count with the steepness of their powers: 5 at the end of the drive. */
    p = modified_play_plain(0.6, 0.0);
    p.sine[2] = (hyst_q28_t)(0.88 * 0.6 / 5.0 * HYST_Q28_ONE);
    expect(HYST_MODIFIED_PLAY_OK, &p, 0);
    p.cosine[2] = p.sine[2] / 2;
    expect(HYST_MODIFIED_PLAY_INVERSE_UNSTABLE, &p, 0);
}

/* The rate's feedback, as in test_inverse.c: alpha acts on rising branches, beta on falling ones. */
static void test_rate_feedback(void) {
    for (int falling = 0; falling < 2; falling++) {
        hyst_modified_play_parameters_t p = modified_play_plain(0.5, 0.0);
        p.slope[0] = HYST_Q28_ONE / 2; /* S = 1, S - 2A = 0.5 on one branch each way */
        hyst_q20_t *growth = falling != 0 ? &p.beta : &p.alpha;
        *growth = (hyst_q20_t)(1.79 * HYST_Q20_ONE);
        expect(HYST_MODIFIED_PLAY_OK, &p, 0);
        *growth = (hyst_q20_t)(1.81 * HYST_Q20_ONE);
        expect(HYST_MODIFIED_PLAY_INVERSE_UNSTABLE, &p, 0);
        p.rate_gain = HYST_Q30_ONE / 2;
        expect(HYST_MODIFIED_PLAY_OK, &p, 0);
        /* With S < 2A the root leaves at -1: 1 + 2 q >= 0.1. */
        p.rate_gain = HYST_Q30_ONE;
        p.slope[0] = -HYST_Q28_ONE / 4; /* S = 0.25, S - 2A = -0.25 */
        *growth = (hyst_q20_t)(0.44 * HYST_Q20_ONE);
        expect(HYST_MODIFIED_PLAY_OK, &p, 0);
        *growth = (hyst_q20_t)(0.46 * HYST_Q20_ONE);
        expect(HYST_MODIFIED_PLAY_INVERSE_UNSTABLE, &p, 0);
    }
}

int main(void) {
    rng = random_start("test_modified_play_refusals", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_sizes);
    RUN_TEST(test_rates);
    RUN_TEST(test_filter);
    RUN_TEST(test_filter_against_its_poles);
    RUN_TEST(test_each_cell_can_make_a_branch_fall);
    RUN_TEST(test_the_refused_branch_really_falls);
    RUN_TEST(test_the_refused_feedback_really_rings);
    RUN_TEST(test_rate_feedback);
    return UNITY_END();
}
