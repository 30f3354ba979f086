/* SPDX-License-Identifier: MIT */
/* The per-sample pipeline: modes, exactness through it, transitions without a bump, limits, parameter swaps. */
#include "hyst/parameters.h"
#include "models.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static hyst_parameters_t parameters_of(const pi_arguments_t *a) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.pi_operators = a->operators;
    p.hysteresis_offset = a->offset;
    p.pi_beta = a->beta;
    p.pi_rate_gain = a->rate_gain;
    memcpy(p.pi_weight, a->weight, sizeof p.pi_weight);
    memcpy(p.pi_threshold, a->threshold, sizeof p.pi_threshold);
    return p;
}

static hyst_compensator_t build(const hyst_parameters_t *p) {
    hyst_compensator_t c;
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(p, &c).error);
    return c;
}

static hyst_q31_t step(const hyst_compensator_t *c, hyst_compensator_state_t *s, hyst_mode_t mode,
                       hyst_q31_t reference) {
    unsigned events;
    return hyst_compensator_step(c, s, mode, reference, &events);
}

/* In every mode the model's memory follows the applied drive, so the plant (the same model) and the compensator never
 * part. */
static void test_memory_follows_the_applied_drive_in_every_mode(void) {
    for (int run = 0; run < 200; run++) {
        const pi_arguments_t a = pi_random(&rng, 10, run % 2 == 0);
        hyst_parameters_t p = parameters_of(&a);
        p.drive_low = -HYST_Q31_MAX / 2;
        p.drive_high = HYST_Q31_MAX / 3;
        p.drive_park = random_between(&rng, p.drive_low, p.drive_high);
        const hyst_compensator_t c = build(&p);
        hyst_compensator_state_t s;
        hyst_compensator_reset(&c, &s);
        hyst_pi_state_t plant;
        hyst_pi_reset(&c.hysteresis.prandtl_ishlinskii, &plant, p.drive_park);
        hyst_mode_t mode = HYST_MODE_PARK;
        for (int k = 0; k < 3000; k++) {
            if (random_unit(&rng) < 0.01) {
                mode = (hyst_mode_t)(random_bits(&rng) % 4U);
            }
            const hyst_q31_t drive = step(&c, &s, mode, random_q31(&rng));
            TEST_ASSERT_TRUE(drive >= p.drive_low && drive <= p.drive_high);
            hyst_pi_advance(&c.hysteresis.prandtl_ishlinskii, &plant, drive);
            for (uint32_t i = 0; i < p.pi_operators; i++) {
                TEST_ASSERT_EQUAL_INT32(hyst_pi_memory(&c.hysteresis.prandtl_ishlinskii, &plant, i),
                                        hyst_pi_memory(&c.hysteresis.prandtl_ishlinskii,
                                                       &hyst_compensator_memory(&s)->prandtl_ishlinskii, i));
            }
            TEST_ASSERT_EQUAL_INT32(plant.rate, hyst_compensator_memory(&s)->prandtl_ishlinskii.rate);
        }
    }
}

/* Once the transition has ended, the plant is where the reference wants it, to a unit or two (composition bound). */
static void test_tracks_exactly_after_the_transition(void) {
    pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    const hyst_parameters_t p = parameters_of(&a);
    const hyst_compensator_t c = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&c, &s);
    hyst_pi_state_t plant;
    hyst_pi_reset(&c.hysteresis.prandtl_ishlinskii, &plant, 0);
    hyst_q31_t reference = 0;
    hyst_q31_t direction = 1 << 20;
    for (int k = 0; k < 40000; k++) {
        if (abs(reference) > HYST_Q31_MAX / 5) {
            direction = reference > 0 ? -abs(direction) : abs(direction);
        }
        reference += direction;
        const hyst_q31_t drive = step(&c, &s, HYST_MODE_COMPENSATE, reference);
        const hyst_q31_t position = hyst_pi_forward(&c.hysteresis.prandtl_ishlinskii, &plant, drive);
        if (k > 3000) {
            TEST_ASSERT_EQUAL_UINT32(0, s.transition.size);
            TEST_ASSERT_INT32_WITHIN(1, reference, position); /* slopes below 1: 1/2 + 1/2 unit */
        }
    }
}

/* The same with creep, at rest and in motion: the plant creeps, the position does not. */
static void test_tracks_exactly_with_creep(void) {
    pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    hyst_parameters_t p = parameters_of(&a);
    p.creep_cells = 4;
    for (uint32_t j = 0; j < p.creep_cells; j++) {
        p.creep[j] = (hyst_creep_cell_t){HYST_Q31_MAX / 40, HYST_Q31_MAX >> (5 + 3 * j)};
    }
    const hyst_compensator_t c = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&c, &s);
    hyst_pi_state_t plant;
    hyst_pi_reset(&c.hysteresis.prandtl_ishlinskii, &plant, 0);
    hyst_creep_state_t creep;
    hyst_creep_settle(&c.creep, &creep, hyst_pi_output(&c.hysteresis.prandtl_ishlinskii, &plant));
    hyst_q31_t reference = 0;
    int64_t moved = 0; /* of the drive while the reference rests */
    for (int k = 0; k < 40000; k++) {
        const bool rests = k % 4000 > 1000;
        reference = rests ? reference : hyst_add(reference, k / 4000 % 2 == 0 ? 1 << 18 : -(1 << 18));
        const hyst_q31_t before = s.drive;
        const hyst_q31_t drive = step(&c, &s, HYST_MODE_COMPENSATE, reference);
        moved += rests ? llabs((int64_t)drive - before) : 0;
        const hyst_q31_t elastic = hyst_pi_forward(&c.hysteresis.prandtl_ishlinskii, &plant, drive);
        const int64_t position = elastic + hyst_creep_offset(&c.creep, &creep);
        hyst_creep_advance(&c.creep, &creep, elastic);
        if (k > 3000) {
            TEST_ASSERT_TRUE(llabs(position - reference) <= 1); /* the inverse of creep is exact: as without it */
        }
    }
    TEST_ASSERT_TRUE(moved > 1000000); /* there was creep to work against */
}

/* A curved Preisach table: E = d (0.3 + 0.15 d) for a way of d, as a play bank of even density would give. */
static void set_preisach(hyst_parameters_t *p, uint32_t intervals) {
    p->family = HYST_FAMILY_PREISACH;
    p->preisach_intervals = intervals;
    for (uint32_t i = 1; i <= intervals; i++) {
        for (uint32_t j = 0; j < i; j++) {
            const double way = 2.0 * (i - j) / intervals;
            p->preisach_everett[HYST_PREISACH_ELEMENTS(i - 1U) + j] =
                (hyst_q28_t)(way * (0.3 + 0.15 * way) * (double)HYST_Q28_ONE);
        }
    }
}

/* Four cells, steep at the reversal. */
static void set_bouc_wen(hyst_parameters_t *p) {
    p->family = HYST_FAMILY_BOUC_WEN;
    p->bouc_wen_cells = 4;
    p->bouc_wen_direct = HYST_Q28_ONE / 2;
    for (uint32_t i = 0; i < p->bouc_wen_cells; i++) {
        p->bouc_wen_length[i] = HYST_Q31_MAX / 8 * (hyst_q31_t)(i + 1U);
        p->bouc_wen_slope[i] = -HYST_Q28_ONE / 8 / (hyst_q28_t)(i + 1U);
    }
}

/* Ten divisions, a damped recursion, a third harmonic. */
static void set_modified_play(hyst_parameters_t *p) {
    hyst_modified_play_parameters_t *m = &p->modified_play[0];
    p->family = HYST_FAMILY_MODIFIED_PLAY;
    p->modified_plays = 1;
    m->divisions = 10;
    m->direct = HYST_Q28_ONE / 4;
    for (uint32_t i = 0; i < HYST_MODIFIED_PLAY_CELLS(10); i++) {
        m->slope[i] = HYST_Q28_ONE / 90;
    }
    m->feedback[0] = HYST_Q28_ONE / 4;
    m->feedback[1] = HYST_Q28_ONE / 8;
    m->bilinear = HYST_Q28_ONE / 50;
    m->sine[1] = HYST_Q28_ONE / 200;
    m->phase_step = UINT32_MAX / 400U;
}

/* g(x) = x + bend (x^2 - 1). */
static void set_curve(hyst_parameters_t *p, double bend) {
    p->drive_curves = 1;
    for (int i = 0; i < HYST_CURVE_NODES; i++) {
        const double x = -1.0 + i / 16.0;
        p->drive_curve[0].node[i] = (hyst_q31_t)((x + bend * (x * x - 1.0)) * (0x1p31 - 1.0));
    }
}

/* Whatever the family, with and without a drive curve, the plant is where the reference wants it. */
static void test_every_family_tracks_exactly_behind_a_curve(void) {
    for (int run = 0; run < 2 * HYST_FAMILY_COUNT; run++) {
        const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
        const double bend = run % 2 == 0 ? 0.0 : 0.2;
        hyst_parameters_t p;
        hyst_parameters_default(&p);
        switch ((hyst_family_t)(run / 2)) {
        case HYST_FAMILY_PREISACH:
            set_preisach(&p, 30);
            break;
        case HYST_FAMILY_BOUC_WEN:
            set_bouc_wen(&p);
            break;
        case HYST_FAMILY_MODIFIED_PLAY:
            set_modified_play(&p);
            break;
        case HYST_FAMILY_PRANDTL_ISHLINSKII:
        case HYST_FAMILY_COUNT:
            p = parameters_of(&a);
            break;
        }
        TEST_ASSERT_EQUAL_UINT32(run / 2, p.family);
        set_curve(&p, bend);
        const hyst_compensator_t c = build(&p);
        hyst_compensator_state_t s;
        hyst_compensator_reset(&c, &s);
        hyst_hysteresis_state_t plant;
        hyst_hysteresis_reset(&c.hysteresis, &plant, hyst_curve_apply(&c.drive_curve, 0));
        hyst_q31_t reference = 0;
        hyst_q31_t direction = 1 << 20;
        int32_t worst = 0;
        for (int k = 0; k < 40000; k++) {
            if (abs(reference) > HYST_Q31_MAX / 6) {
                direction = (reference > 0 ? -1 : 1) * random_between(&rng, 1 << 18, 1 << 21);
            }
            reference += direction;
            const hyst_q31_t drive = step(&c, &s, HYST_MODE_COMPENSATE, reference);
            hyst_hysteresis_advance(&c.hysteresis, &plant, hyst_curve_apply(&c.drive_curve, drive));
            const int32_t error = abs(hyst_hysteresis_output(&c.hysteresis, &plant) - reference);
            worst = k > 3000 && error > worst ? error : worst;
        }
        /* The slopes of all families are below 1: half a unit from solve, half from output. The curve rounds twice, at
         * slopes up to 1 + 2 bend: (1 + 2 bend) / 2 + 1/2 more. */
        TEST_ASSERT_LESS_OR_EQUAL_INT32(bend > 0.0 ? 2 : 1, worst);
    }
}

/* With one inertia section the drive is the static one plus the filter of the position, and the memory follows the
 * static one. */
static void test_inertia_adds_its_share_of_the_drive(void) {
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    hyst_parameters_t p = parameters_of(&a);
    const hyst_compensator_t still = build(&p);
    const double mass = 0.9, damping = 0.4; /* of drive per position and sample^2, sample */
    p.inertia_sections = 1;
    p.inertia[0].b0 = (hyst_q28_t)((mass + 1.5 * damping) * (double)HYST_Q28_ONE);
    p.inertia[0].b2 = (hyst_q28_t)((mass + 0.5 * damping) * (double)HYST_Q28_ONE);
    p.inertia[0].b1 = -p.inertia[0].b0 - p.inertia[0].b2;
    const hyst_compensator_t moving = build(&p);
    hyst_compensator_state_t without, with;
    hyst_compensator_reset(&still, &without);
    hyst_compensator_reset(&moving, &with);
    double past[2] = {0.0, 0.0};
    for (int k = 0; k < 20000; k++) {
        const double wave = 0.2 * sin(0.03 * k) * (k < 5000 ? k / 5000.0 : 1.0);
        const hyst_q31_t reference = (hyst_q31_t)(wave * 0x1p31);
        const hyst_q31_t plain = step(&still, &without, HYST_MODE_COMPENSATE, reference);
        const hyst_q31_t drive = step(&moving, &with, HYST_MODE_COMPENSATE, reference);
        const double share =
            (p.inertia[0].b0 * (double)reference + p.inertia[0].b1 * past[0] + p.inertia[0].b2 * past[1]) * 0x1p-28;
        if (k > 3000) {
            /* The filter carries what rounding drops into the next sample: one unit. */
            TEST_ASSERT_DOUBLE_WITHIN(1.5, plain + share, drive);
            TEST_ASSERT_EQUAL_INT32(hyst_compensator_memory(&without)->prandtl_ishlinskii.drive,
                                    hyst_compensator_memory(&with)->prandtl_ishlinskii.drive);
        }
        past[1] = past[0];
        past[0] = reference;
    }
}

/* At a constant reference, changing the mode or the parameters moves the drive by at most transition_slew per sample.
 */
static void test_changes_do_not_bump(void) {
    int64_t worst = 0;
    for (int run = 0; run < 300; run++) {
        hyst_compensator_t c[2];
        for (int i = 0; i < 2; i++) {
            const pi_arguments_t a =
                pi_random(&rng, (uint32_t)(random_bits(&rng) % (HYST_PI_MAX_OPERATORS + 1U)), false);
            hyst_parameters_t p = parameters_of(&a);
            p.transition_slew = 1 << 22;
            p.drive_park = random_q31(&rng);
            p.linear_offset = random_q31(&rng) / 4;
            if (random_unit(&rng) < 0.5) { /* a cascade that appears and disappears with the swap */
                p.shape_sections = 1;
                p.shape[0] = (hyst_iir_section_t){HYST_Q28_ONE / 4, 0, 0, -HYST_Q28_ONE / 4 * 3, 0};
            }
            if (random_unit(&rng) < 0.3) {
                p.equalise_sections = 1;
                p.equalise[0] = (hyst_iir_section_t){HYST_Q28_ONE, 0, 0, 0, 0};
            }
            c[i] = build(&p);
        }
        hyst_compensator_state_t s;
        hyst_compensator_reset(&c[0], &s);
        const hyst_compensator_t *active = &c[0];
        const hyst_compensator_t *next = &c[0];
        hyst_mode_t mode = HYST_MODE_PARK;
        const hyst_q31_t reference = random_q31(&rng) / 4;
        hyst_q31_t last = s.drive;
        for (int k = 0; k < 4000; k++) {
            if (random_unit(&rng) < 0.002) {
                mode = (hyst_mode_t)(random_bits(&rng) % 4U);
            }
            if (random_unit(&rng) < 0.002) {
                next = active == &c[0] ? &c[1] : &c[0];
            }
            if (next != active && hyst_compensator_adopt(active, next, &s)) {
                active = next;
            }
            const hyst_q31_t drive = step(active, &s, mode, reference);
            worst = llabs((int64_t)drive - last) > worst ? llabs((int64_t)drive - last) : worst;
            last = drive;
        }
    }
    printf("largest step of the drive: %.3f of transition_slew\n", (double)worst / (1 << 22));
    /*
     * Exactly one slew: the offset's decay moves the drive toward what the model wants along a monotone path, and a
     * monotone path does not change where its end leads (wiping out), so the model's wish stands still meanwhile.
     */
    TEST_ASSERT_TRUE_MESSAGE(worst <= INT64_C(1) << 22, "the drive jumped");
}

/* Creep that appears with new parameters starts at rest where the actuator is: the drive goes on from its value and the
 * cells are still. */
static void test_new_creep_starts_at_rest(void) {
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    hyst_parameters_t p = parameters_of(&a);
    const hyst_compensator_t without = build(&p);
    p.creep_cells = 2;
    p.creep[0] = (hyst_creep_cell_t){HYST_Q31_MAX / 50, HYST_Q31_MAX / 1000};
    p.creep[1] = (hyst_creep_cell_t){HYST_Q31_MAX / 50, HYST_Q31_MAX / 30};
    const hyst_compensator_t with = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&without, &s);
    for (int k = 0; k < 3000; k++) {
        (void)step(&without, &s, HYST_MODE_DIRECT, HYST_Q31_MAX / 3);
    }
    const hyst_q31_t before = s.drive;
    while (!hyst_compensator_adopt(&without, &with, &s)) {
    }
    const int64_t offset = hyst_creep_offset(&with.creep, &s.creep);
    for (int k = 0; k < 3000; k++) {
        TEST_ASSERT_EQUAL_INT32(before, step(&with, &s, HYST_MODE_DIRECT, HYST_Q31_MAX / 3));
        TEST_ASSERT_INT64_WITHIN(1, offset, hyst_creep_offset(&with.creep, &s.creep)); /* rounding of the levels */
    }
}

static void test_adopting_the_same_parameters_changes_nothing(void) {
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    const hyst_parameters_t p = parameters_of(&a);
    const hyst_compensator_t c = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&c, &s);
    for (int k = 0; k < 5000; k++) {
        (void)step(&c, &s, HYST_MODE_COMPENSATE, HYST_Q31_MAX / 8);
    }
    const hyst_q31_t before = s.drive;
    while (!hyst_compensator_adopt(&c, &c, &s)) {
    }
    TEST_ASSERT_EQUAL_INT32(before, step(&c, &s, HYST_MODE_COMPENSATE, HYST_Q31_MAX / 8));
    TEST_ASSERT_EQUAL_UINT32(0, s.transition.size);
}

static void test_modes_do_what_they_say(void) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.linear_offset = 1000;
    p.linear_gain = HYST_Q28_ONE / 2;
    p.drive_park = -77;
    p.transition_slew = HYST_Q31_MAX;
    const hyst_compensator_t c = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&c, &s);
    const hyst_q31_t reference = 1 << 24;
    const hyst_q31_t wanted[] = {-77, reference, reference / 2 + 1000, reference};
    for (int mode = HYST_MODE_COMPENSATE; mode >= HYST_MODE_PARK; mode--) {
        for (int k = 0; k < 3; k++) {
            (void)step(&c, &s, (hyst_mode_t)mode, reference);
        }
        TEST_ASSERT_EQUAL_INT32(wanted[mode], s.drive);
    }
}

static void test_events(void) {
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    hyst_parameters_t p = parameters_of(&a);
    p.drive_high = HYST_Q31_MAX / 4;
    p.transition_slew = HYST_Q31_MAX;
    const hyst_compensator_t c = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&c, &s);
    unsigned events = 99;
    (void)hyst_compensator_step(&c, &s, HYST_MODE_COMPENSATE, 0, &events);
    TEST_ASSERT_EQUAL_UINT(0, events);
    (void)hyst_compensator_step(&c, &s, HYST_MODE_COMPENSATE, HYST_Q31_MAX / 4, &events);
    TEST_ASSERT_EQUAL_UINT(HYST_STEP_DRIVE_LIMITED, events);
    TEST_ASSERT_EQUAL_INT32(HYST_Q31_MAX / 4, s.drive);
    (void)hyst_compensator_step(&c, &s, HYST_MODE_COMPENSATE, HYST_Q31_MAX, &events);
    TEST_ASSERT_EQUAL_UINT(HYST_STEP_DRIVE_LIMITED | HYST_STEP_UNREACHABLE, events);
}

/* A transition has a size and a way, and its sum with the drive is never made where it does not fit. Against the same
 * in 64 bits, at both ends of everything. */
static void test_transition_and_limits_are_exact_at_the_ends(void) {
    static const hyst_q31_t end[] = {HYST_Q31_MIN, HYST_Q31_MIN + 1, -2, -1, 0, 1, 2, HYST_Q31_MAX - 1, HYST_Q31_MAX};
    enum { ENDS = sizeof end / sizeof end[0] };
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    hyst_compensator_t c = build(&p);
    hyst_compensator_state_t s;
    hyst_compensator_reset(&c, &s);
    (void)step(&c, &s, HYST_MODE_DIRECT, 0);
    for (int k = 0; k < 300000; k++) {
        const bool wild = k % 4 == 0;
        const hyst_q31_t reference = wild ? random_q31(&rng) : end[random_bits(&rng) % ENDS];
        const hyst_q31_t a = wild ? random_q31(&rng) : end[random_bits(&rng) % ENDS];
        const hyst_q31_t b = wild ? random_q31(&rng) : end[random_bits(&rng) % ENDS];
        const hyst_q31_t low = a < b ? a : b, high = a < b ? b : a;
        const uint32_t size = (uint32_t)(wild ? random_q31(&rng) : end[random_bits(&rng) % ENDS]);
        const bool falls = random_bits(&rng) % 2U != 0;
        c.transition_slew = wild ? 1 : HYST_Q31_MAX - (hyst_q31_t)(random_bits(&rng) % 2U);
        s.transition = (hyst_transition_t){.size = size, .falls = falls};
        const uint32_t slew = (uint32_t)c.transition_slew;
        const int64_t rest = size > slew ? (int64_t)(size - slew) : 0;
        const int64_t sum = falls ? reference - rest : reference + rest;
        unsigned events;
        const hyst_q31_t drive = hyst_compensator_step_within(&c, &s, HYST_MODE_DIRECT, reference, low, high, &events);
        TEST_ASSERT_EQUAL_INT32(hyst_clamp(hyst_saturate(sum), low, high), drive);
        TEST_ASSERT_EQUAL_UINT(sum != drive ? HYST_STEP_DRIVE_LIMITED : 0, events);
        TEST_ASSERT_EQUAL_INT64(falls ? -rest : rest, hyst_transition_value(s.transition));
    }
}

int main(void) {
    rng = random_start("test_compensator", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_memory_follows_the_applied_drive_in_every_mode);
    RUN_TEST(test_tracks_exactly_after_the_transition);
    RUN_TEST(test_tracks_exactly_with_creep);
    RUN_TEST(test_every_family_tracks_exactly_behind_a_curve);
    RUN_TEST(test_inertia_adds_its_share_of_the_drive);
    RUN_TEST(test_changes_do_not_bump);
    RUN_TEST(test_new_creep_starts_at_rest);
    RUN_TEST(test_adopting_the_same_parameters_changes_nothing);
    RUN_TEST(test_modes_do_what_they_say);
    RUN_TEST(test_events);
    RUN_TEST(test_transition_and_limits_are_exact_at_the_ends);
    return UNITY_END();
}
