/* SPDX-License-Identifier: MIT */
/*
 * The Bouc-Wen model against the differential equation's exact solution and against its own cells in long double;
 * composition, independence of the step, extremes, refusals.
 */
#include "bouc_wen_models.h"
#include "composition.h"
#include "unity.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* The cells again, in long double and without a stored place: h alone is the memory, and every step looks for it. */
typedef struct {
    const bouc_wen_arguments_t *a;
    long double drive, h, end; /* units of 2^-31 */
    int side;
} plain_t;

static plain_t plain_open(const bouc_wen_arguments_t *a) {
    plain_t p = {.a = a, .side = 1};
    for (uint32_t i = 0; i < a->cells; i++) {
        p.end += 0.5L * a->length[i] * (a->slope[i] * 0x1p-28L);
    }
    return p;
}

static void plain_advance(plain_t *p, long double drive) {
    long double step = drive - p->drive;
    const int side = step < 0 ? -1 : 1;
    p->side = step != 0.0L ? side : p->side;
    step = fabsl(step);
    long double h = side * p->h;
    long double begin = -p->end;
    for (uint32_t i = 0; i < p->a->cells && step > 0.0L; i++) {
        const long double slope = p->a->slope[i] * 0x1p-28L;
        const long double end = begin + slope * p->a->length[i];
        const long double left = fminl((end - h) / slope, (long double)p->a->length[i]);
        if (left > 0.0L) {
            const long double travelled = fminl(left, step);
            h += travelled * slope;
            step -= travelled;
        }
        begin = end;
    }
    p->h = side * h;
    p->drive = drive;
}

static long double plain_output(const plain_t *p) {
    return p->a->offset + p->drive * p->a->direct * 0x1p-28L + p->h;
}

typedef enum { REST, CREEP, RAMP, JUMP, EXTREME, KINDS } kind_t;

static hyst_q31_t next_drive(kind_t kind, hyst_q31_t drive, hyst_q31_t ramp) {
    switch (kind) {
    case REST:
        return drive;
    case CREEP:
        return hyst_add(drive, random_between(&rng, -3, 3));
    case RAMP:
        return hyst_add(drive, ramp);
    case EXTREME:
        return random_unit(&rng) < 0.5 ? INT32_MIN : INT32_MAX;
    default:
        return random_q31(&rng);
    }
}

static double deviation(double beta, double gamma, double share, uint32_t cells) {
    const bouc_wen_arguments_t a = bouc_wen_cells(beta, gamma, share, 0.7, cells);
    const hyst_bouc_wen_t model = bouc_wen_accept(&a);
    hyst_bouc_wen_state_t state;
    hyst_bouc_wen_reset(&model, &state, 0);
    bouc_wen_exact_t exact = {.beta = beta, .gamma = gamma};
    double worst = 0.0;
    for (int k = 1; k < 20000; k++) {
        const double u = 0.9 * sin(k * 0.01) * (0.55 + 0.45 * cos(k * 0.00071));
        const hyst_q31_t drive = (hyst_q31_t)lround(u * 0x1p31);
        bouc_wen_exact_advance(&exact, drive * 0x1p-31);
        const double got = (hyst_bouc_wen_forward(&model, &state, drive) - 0.7 * drive) * 0x1p-31;
        worst = fmax(worst, fabs(got - share * exact.h));
    }
    return worst / fabs(share);
}

/* A chord of the exponential, the curve cut into n places that share its bend, is off by (bend / n)^2 / 8 at its
 * middle. The whole bend is at most 2 + 2 (h from -1 to 1), so 2 / n^2; starting points of branches are off as much
 * again. */
static void test_follows_the_differential_equation(void) {
    static const struct {
        double beta, gamma;
    } kinds[] = {{1.0, 1.0}, {3.0, 1.0}, {1.0, 3.0}, {0.5, 0.2}, {10.0, 8.0}, {2.0, -1.0}};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        /* The share keeps direct + share dH/dv positive: dH/dv <= 2 max(A, beta). */
        const double steepest = 2.0 * fmax(kinds[k].beta + kinds[k].gamma, kinds[k].beta);
        const double share = (k % 2 == 0 ? -0.5 : 0.5) / steepest;
        const double coarse = deviation(kinds[k].beta, kinds[k].gamma, share, 16);
        const double fine = deviation(kinds[k].beta, kinds[k].gamma, share, 64);
        printf("beta %4.1f gamma %4.1f: off by %.2e of the largest h with 16 cells, %.2e with 64\n", kinds[k].beta,
               kinds[k].gamma, coarse, fine);
        TEST_ASSERT_TRUE(coarse <= 4.0 / (16.0 * 16.0));
        TEST_ASSERT_TRUE(fine <= 4.0 / (64.0 * 64.0));
        TEST_ASSERT_TRUE(fine < coarse / 8.0); /* goes with 1/n^2: 16 */
    }
}

/*
 * A reversal rounds the place to half a unit of drive, which moves h by half the difference of two slopes (each below
 * 4) once the next boundary is passed. On its way along a branch an error of h grows with the slope there: by (beta +
 * gamma) / (2 beta) at most, below 3 here, and it shrinks to nothing towards the branch's end. Rounding the output
 * costs 1/2.
 */
static void test_equals_its_cells_in_long_double(void) {
    double worst = 0.0;
    for (int run = 0; run < 300; run++) {
        const double beta = 0.5 + 5.0 * random_unit(&rng);
        const double gamma = beta * (4.0 * random_unit(&rng) - 0.5);
        const double share = (random_unit(&rng) < 0.5 ? -0.5 : 0.5) / fmax(2.0 * beta, beta + gamma);
        const bouc_wen_arguments_t a =
            bouc_wen_cells(beta, gamma, share, 0.7, 8U + (uint32_t)(random_bits(&rng) % 57U));
        const hyst_bouc_wen_t model = bouc_wen_accept(&a);
        hyst_bouc_wen_state_t state;
        hyst_bouc_wen_reset(&model, &state, 0);
        plain_t plain = plain_open(&a);
        kind_t kind = JUMP;
        hyst_q31_t drive = 0;
        hyst_q31_t ramp = 1;
        for (int k = 0; k < 1000; k++) {
            if (random_unit(&rng) < 0.05) {
                kind = (kind_t)(random_bits(&rng) % KINDS);
                ramp = random_q31(&rng) >> (random_bits(&rng) % 31U);
            }
            drive = next_drive(kind, drive, ramp);
            plain_advance(&plain, drive);
            const hyst_q31_t got = hyst_bouc_wen_forward(&model, &state, drive);
            const long double exact = fmaxl(-0x1p31L, fminl(0x1p31L - 1.0L, plain_output(&plain)));
            worst = fmax(worst, (double)fabsl(got - exact));
        }
    }
    printf("against long double, 300 models: worst error %.2f * 2^-31\n", worst);
    TEST_ASSERT_TRUE(worst < 8.0); /* 1/2 + three times half of the largest difference of slopes, 4 */
}

/* Rate independence to the bit: however a movement is cut into samples, the memory after it is the same. */
static void test_one_long_step_is_many_short_ones(void) {
    for (int run = 0; run < 500; run++) {
        const bouc_wen_arguments_t a = bouc_wen_random(&rng);
        const hyst_bouc_wen_t model = bouc_wen_accept(&a);
        hyst_bouc_wen_state_t one, many;
        hyst_bouc_wen_reset(&model, &one, 0);
        hyst_bouc_wen_reset(&model, &many, 0);
        for (int k = 0; k < 50; k++) {
            const hyst_q31_t target = random_q31(&rng);
            const int64_t distance = (int64_t)target - many.drive;
            for (int part = 1; part < 20; part++) {
                hyst_bouc_wen_advance(&model, &many, (hyst_q31_t)(one.drive + distance * part / 20));
            }
            hyst_bouc_wen_advance(&model, &many, target);
            hyst_bouc_wen_advance(&model, &one, target);
            TEST_ASSERT_EQUAL_INT64(one.place, many.place);
            TEST_ASSERT_EQUAL_INT64(one.rest, many.rest);
            TEST_ASSERT_EQUAL_INT(one.side, many.side);
        }
    }
}

static hyst_q31_t reference_sample(const hyst_bouc_wen_t *model, const hyst_bouc_wen_state_t *state, kind_t kind,
                                   hyst_q31_t ramp) {
    if (random_unit(&rng) < 0.1) {
        return hyst_add(hyst_bouc_wen_output(model, state), random_between(&rng, -3, 4));
    }
    if (kind == EXTREME) {
        return random_unit(&rng) < 0.5 ? INT32_MIN : INT32_MAX;
    }
    /* At the corners: the drive that reaches the end of a cell, and its neighbours. */
    hyst_q31_t drive = next_drive(kind, state->drive, ramp);
    if (kind == JUMP && model->cells > 0 && random_unit(&rng) < 0.5) {
        const int64_t corner = model->place[random_bits(&rng) % (model->cells + 1U)] - state->place;
        drive = hyst_saturate(state->drive + state->side * corner + random_between(&rng, -1, 1));
    }
    hyst_bouc_wen_state_t probe = *state;
    return hyst_bouc_wen_forward(model, &probe, drive);
}

static void test_composition(void) {
    composition_count_t total = {0, 0, 0};
    while (total.composed < composition_samples()) {
        const bouc_wen_arguments_t a = bouc_wen_random(&rng);
        const hyst_bouc_wen_t model = bouc_wen_accept(&a);
        hyst_bouc_wen_state_t inverse, forward;
        hyst_bouc_wen_reset(&model, &inverse, 0);
        hyst_bouc_wen_reset(&model, &forward, 0);
        double steepest = a.direct;
        for (uint32_t i = 0; i < a.cells; i++) {
            steepest = fmax(steepest, (double)a.direct + a.slope[i]);
        }
        /* Rounding the drive costs half the steepest slope, rounding the output 1/2; the error is an integer. */
        const int64_t bound = (int64_t)floor(0.5 * steepest / HYST_Q28_ONE + 0.5);
        kind_t kind = REST;
        hyst_q31_t ramp = 1;
        for (int k = 0; k < 20000; k++) {
            if (random_unit(&rng) < 0.02) {
                kind = (kind_t)(random_bits(&rng) % KINDS);
                ramp = random_q31(&rng) >> (random_bits(&rng) % 31U);
            }
            const hyst_q31_t wanted = reference_sample(&model, &inverse, kind, ramp);
            bool saturated = false;
            const hyst_q31_t drive = hyst_bouc_wen_inverse(&model, &inverse, wanted, &saturated);
            const hyst_q31_t got = hyst_bouc_wen_forward(&model, &forward, drive);
            composition_add(&total, wanted, drive, saturated, got, bound);
        }
    }
    composition_report(&total);
}

/* The largest of everything the validator accepts, driven from end to end: the sanitizers look for overflow. */
static void test_extremes(void) {
    static const int corner[] = {1, -1};
    for (size_t s = 0; s < 2; s++) {
        bouc_wen_arguments_t a = {.cells = HYST_BOUC_WEN_MAX_CELLS, .offset = s == 0 ? INT32_MAX : INT32_MIN};
        a.direct = s == 0 ? HYST_BOUC_WEN_MIN_SLOPE : (hyst_q28_t)HYST_BOUC_WEN_MAX_SLOPE;
        const hyst_q28_t most = (hyst_q28_t)HYST_BOUC_WEN_MAX_SLOPE - HYST_BOUC_WEN_MIN_SLOPE;
        for (uint32_t i = 0; i < a.cells; i++) {
            a.slope[i] = corner[s] * (i == 0 ? most : 1);
            a.length[i] = i == 0 ? (1 << 30) : (1 << 24);
        }
        const hyst_bouc_wen_t model = bouc_wen_accept(&a);
        hyst_bouc_wen_state_t state;
        hyst_bouc_wen_reset(&model, &state, INT32_MIN);
        for (int k = 0; k < 1000; k++) {
            const hyst_q31_t drive = k % 3 == 0 ? INT32_MIN : k % 3 == 1 ? INT32_MAX : random_q31(&rng);
            (void)hyst_bouc_wen_forward(&model, &state, drive);
            bool saturated = false;
            (void)hyst_bouc_wen_solve(&model, &state, k % 2 == 0 ? INT32_MIN : INT32_MAX, &saturated);
            TEST_ASSERT_TRUE(state.place >= 0 && state.place <= model.place[model.cells]);
            TEST_ASSERT_TRUE(llabs(state.rest) <= (INT64_C(1) << 29) + 1);
        }
    }
}

/* In as many calls as it takes. */
static unsigned carry(const hyst_bouc_wen_t *from, const hyst_bouc_wen_state_t *state, const hyst_bouc_wen_t *to,
                      hyst_bouc_wen_state_t *to_state) {
    uint32_t carried = 0;
    unsigned calls = 1;
    while (!hyst_bouc_wen_carry(from, state, to, to_state, &carried)) {
        calls++;
    }
    return calls;
}

static void test_carry(void) {
    unsigned differs_at_last = 0; /* curves that only their last corner tells apart */
    for (int run = 0; run < 200; run++) {
        const bouc_wen_arguments_t a = bouc_wen_random(&rng);
        bouc_wen_arguments_t b = bouc_wen_random(&rng);
        const hyst_bouc_wen_t from = bouc_wen_accept(&a);
        const hyst_bouc_wen_t to = bouc_wen_accept(&b);
        hyst_bouc_wen_state_t state, same, other, at_last;
        memset(&state, 0, sizeof state);
        memset(&at_last, 0, sizeof at_last);
        hyst_bouc_wen_reset(&from, &state, random_q31(&rng));
        for (int k = 0; k < 20; k++) {
            hyst_bouc_wen_advance(&from, &state, random_q31(&rng));
        }
        memset(&same, 0, sizeof same);
        TEST_ASSERT_EQUAL_UINT((from.cells + HYST_BOUC_WEN_CARRY_CORNERS) / HYST_BOUC_WEN_CARRY_CORNERS,
                               carry(&from, &state, &from, &same));
        TEST_ASSERT_TRUE(same.place == state.place && same.rest == state.rest && same.side == state.side &&
                         same.drive == state.drive);
        TEST_ASSERT_TRUE(carry(&from, &state, &to, &other) <= HYST_BOUC_WEN_CARRY_CALLS);
        hyst_bouc_wen_t longer = from;
        longer.share[from.cells] *= 2;
        (void)carry(&from, &state, &longer, &at_last);
        differs_at_last += from.cells > 0 && memcmp(&at_last, &state, sizeof state) != 0 ? 1U : 0U;
        TEST_ASSERT_EQUAL_INT32(state.drive, other.drive);
        const double end = (double)from.share[from.cells];
        if (a.cells > 0 && fabs(end) > 0x1p40) { /* else h is a handful of units */
            const double h = (hyst_bouc_wen_output(&from, &state) - (double)a.offset -
                              state.drive * (double)a.direct / HYST_Q28_ONE) *
                             0x1p28 / end;
            const double carried =
                (hyst_bouc_wen_output(&to, &other) - (double)b.offset - state.drive * (double)b.direct / HYST_Q28_ONE) *
                0x1p28;
            if (llabs(hyst_bouc_wen_output(&from, &state)) < INT32_MAX - 4 &&
                llabs(hyst_bouc_wen_output(&to, &other)) < INT32_MAX - 4) {
                /* one unit of an output is 2^28 / end of h, and hyst_bouc_wen_carry knows the ends to such units */
                const double unit = fabs((double)to.share[to.cells] / end) * 0x1p28;
                TEST_ASSERT_TRUE(fabs(carried - h * (double)to.share[to.cells]) <=
                                 4.0 * unit + 0x1p30 + 0x1p-27 * fabs((double)to.share[to.cells]));
            }
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(100, differs_at_last);
}

static void expect(hyst_bouc_wen_status_t status, const bouc_wen_arguments_t *a, uint32_t at) {
    hyst_bouc_wen_t model;
    memset(&model, 0x5A, sizeof model);
    const hyst_bouc_wen_t before = model;
    uint32_t element = 99;
    TEST_ASSERT_EQUAL_INT(status, bouc_wen_build(a, &model, &element));
    TEST_ASSERT_EQUAL_UINT32(at, element);
    TEST_ASSERT_EQUAL_MEMORY(&before, &model, sizeof model);
}

static void test_refusals(void) {
    const bouc_wen_arguments_t good = bouc_wen_cells(2.0, 1.0, -0.2, 1.0, 32);
    (void)bouc_wen_accept(&good);
    bouc_wen_arguments_t a = good;
    a.cells = HYST_BOUC_WEN_MAX_CELLS + 1;
    expect(HYST_BOUC_WEN_TOO_MANY_CELLS, &a, 0);
    a = good;
    a.length[7] = 0;
    expect(HYST_BOUC_WEN_LENGTH_NOT_POSITIVE, &a, 7);
    a.length[7] = INT32_MIN;
    expect(HYST_BOUC_WEN_LENGTH_NOT_POSITIVE, &a, 7);
    a = good;
    a.slope[9] = 0;
    expect(HYST_BOUC_WEN_SLOPE_SIGN, &a, 9);
    a.slope[9] = -good.slope[9];
    expect(HYST_BOUC_WEN_SLOPE_SIGN, &a, 9);
    a = good;
    a.direct = HYST_BOUC_WEN_MIN_SLOPE - 1;
    expect(HYST_BOUC_WEN_TOO_FLAT, &a, 0);
    a = good;
    a.slope[3] = -(a.direct - HYST_BOUC_WEN_MIN_SLOPE + 1); /* the equation's own trap: d + s A <= 0 */
    expect(HYST_BOUC_WEN_TOO_FLAT, &a, 3);
    a = good;
    a.direct = INT32_MAX;
    expect(HYST_BOUC_WEN_TOO_STEEP, &a, 0);
    a = (bouc_wen_arguments_t){.cells = 1, .direct = HYST_Q28_ONE, .length = {1}, .slope = {INT32_MAX}};
    expect(HYST_BOUC_WEN_TOO_STEEP, &a, 0);
    a = (bouc_wen_arguments_t){.cells = 1, .direct = HYST_Q28_ONE, .length = {1}, .slope = {3 * HYST_Q28_ONE}};
    (void)bouc_wen_accept(&a);
    a.slope[0]++;
    expect(HYST_BOUC_WEN_TOO_STEEP, &a, 0);
    a.slope[0] = 2 * HYST_Q28_ONE;
    a.length[0] = INT32_MAX; /* E = 1 - 2^-31 */
    (void)bouc_wen_accept(&a);
    a.slope[0]++;
    expect(HYST_BOUC_WEN_BRANCH_TOO_LONG, &a, 0);
    a = good;
    a.direct = 3 * HYST_Q28_ONE;
    for (uint32_t i = 0; i < a.cells; i++) {
        a.slope[i] = 1;
        a.length[i] = INT32_MAX;
    }
    expect(HYST_BOUC_WEN_BRANCH_TOO_LONG, &a, 2); /* three cells of 2^31 units climb by 9 */
}

int main(void) {
    rng = random_start("test_bouc_wen", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_equals_its_cells_in_long_double);
    RUN_TEST(test_follows_the_differential_equation);
    RUN_TEST(test_one_long_step_is_many_short_ones);
    RUN_TEST(test_composition);
    RUN_TEST(test_extremes);
    RUN_TEST(test_carry);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
