/* SPDX-License-Identifier: MIT */
/* The reference as a reading of a curved sensor: its curve undone, the pipeline behind it untouched, no bump when the
 * curve changes, and what the validator refuses. */
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

/* reading = s + q s^2 + k s^3 within +-1, straight beyond. */
typedef struct {
    double q, k;
    double least, most; /* slope between -1 and 1 */
} sensor_t;

static double slope_of(const sensor_t *sensor, double s) {
    return 1.0 + s * (2.0 * sensor->q + 3.0 * sensor->k * s);
}

static sensor_t random_sensor(void) {
    sensor_t sensor;
    do {
        sensor = (sensor_t){.q = 0.8 * (random_unit(&rng) - 0.5), .k = 0.6 * (random_unit(&rng) - 0.5)};
        sensor.least = fmin(slope_of(&sensor, -1.0), slope_of(&sensor, 1.0));
        sensor.most = fmax(slope_of(&sensor, -1.0), slope_of(&sensor, 1.0));
        if (fabs(sensor.q) < 3.0 * fabs(sensor.k)) { /* an extreme inside */
            const double inside = slope_of(&sensor, -sensor.q / (3.0 * sensor.k));
            sensor.least = fmin(sensor.least, inside);
            sensor.most = fmax(sensor.most, inside);
        }
    } while (sensor.least < 0.3);
    return sensor;
}

static double reading_of(const sensor_t *sensor, double position) {
    const double s = fmax(-1.0, fmin(1.0, position));
    return s + s * s * (sensor->q + sensor->k * s) + (position - s) * slope_of(sensor, s);
}

static double position_of(const sensor_t *sensor, double reading) {
    double low = -20.0, high = 20.0; /* the slope is at least 0.3, and |reading| at most 1 */
    for (int i = 0; i < 70; i++) {
        const double middle = 0.5 * (low + high);
        *(reading_of(sensor, middle) < reading ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* Full scale behind the curve: the positions that are read as the ends of the reference's range. */
typedef struct {
    double center, half;
} scale_t;

static scale_t undo(const sensor_t *sensor, hyst_parameters_t *p) {
    const double from = position_of(sensor, -1.0), to = position_of(sensor, 1.0);
    const scale_t scale = {0.5 * (from + to), 0.5 * (to - from)};
    p->reference_curves = 1;
    for (int i = 0; i < HYST_CURVE_NODES; i++) {
        const double node = (position_of(sensor, -1.0 + i / 16.0) - scale.center) / scale.half;
        p->reference_curve[0].node[i] = (hyst_q31_t)fmin(floor(node * 0x1p31 + 0.5), 0x1p31 - 1.0);
    }
    return scale;
}

static hyst_compensator_t build(const hyst_parameters_t *p) {
    hyst_compensator_t c;
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(p, &c).error);
    return c;
}

/*
 * Without a hysteresis the drive is the position, and what the sensor reads there is the reference. Off by the chords
 * of the inverse, h^2 / 8 of its curvature |C''| / C'^3, h = 1/16, and by 3 units of rounding (node, curve, drive) and
 * one because the last node is below 1; all times the sensor's slope.
 */
static void test_the_sensor_reads_the_reference(void) {
    double worst_part = 0.0;
    for (int run = 0; run < 300; run++) {
        const sensor_t sensor = random_sensor();
        hyst_parameters_t p;
        hyst_parameters_default(&p);
        p.transition_slew = HYST_Q31_MAX;
        const scale_t scale = undo(&sensor, &p);
        const hyst_compensator_t c = build(&p);
        const double curvature = (2.0 * fabs(sensor.q) + 6.0 * fabs(sensor.k)) / pow(sensor.least, 3.0);
        const double bound = sensor.most * (curvature / (8.0 * 16.0 * 16.0) + 4.0 * 0x1p-31 * scale.half);
        hyst_compensator_state_t s;
        hyst_compensator_reset(&c, &s);
        for (int k = 0; k < 1000; k++) {
            const hyst_q31_t ends[] = {HYST_Q31_MIN, HYST_Q31_MAX, 0};
            const hyst_q31_t reference = k < 9 ? ends[k / 3] : random_q31(&rng);
            unsigned events;
            const hyst_q31_t drive = hyst_compensator_step(&c, &s, HYST_MODE_COMPENSATE, reference, &events);
            if (k > 2) { /* the transition is over */
                const double reading = reading_of(&sensor, scale.center + scale.half * drive * 0x1p-31);
                worst_part = fmax(worst_part, fabs(reading - reference * 0x1p-31) / bound);
                TEST_ASSERT_EQUAL_UINT(0, events);
            }
        }
    }
    printf("largest error: %.2f of its bound\n", worst_part);
    TEST_ASSERT_TRUE(worst_part <= 1.0);
    TEST_ASSERT_TRUE(worst_part > 0.3); /* the chords are the error, not only a bound */
}

/* A higher reading never asks for a lower drive, from one end of the range to the other. */
static void test_the_drive_rises_with_the_reference(void) {
    for (int run = 0; run < 30; run++) {
        const sensor_t sensor = random_sensor();
        hyst_parameters_t p;
        hyst_parameters_default(&p);
        (void)undo(&sensor, &p);
        const hyst_compensator_t c = build(&p);
        hyst_q31_t last = HYST_Q31_MIN;
        for (int64_t reference = HYST_Q31_MIN; reference <= HYST_Q31_MAX;
             reference += random_between(&rng, 1, 1 << 21)) {
            const hyst_q31_t position = hyst_curve_apply(&c.reference_curve, (hyst_q31_t)reference);
            TEST_ASSERT_TRUE(position >= last);
            last = position;
        }
    }
}

/* A set with everything that can stand around a play bank. */
static hyst_parameters_t full_parameters(void) {
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE / 3);
    const hyst_iir_section_t lead = {HYST_Q28_ONE / 2 * 3, -HYST_Q28_ONE, 0, -HYST_Q28_ONE / 2, 0};
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.pi_operators = a.operators;
    p.hysteresis_offset = a.offset;
    p.pi_beta = a.beta;
    p.pi_rate_gain = a.rate_gain;
    memcpy(p.pi_weight, a.weight, sizeof p.pi_weight);
    memcpy(p.pi_threshold, a.threshold, sizeof p.pi_threshold);
    p.linear_offset = 12345;
    p.shape_sections = p.equalise_sections = 1;
    p.shape[0] = p.equalise[0] = lead;
    p.creep_cells = 1;
    p.creep[0] = (hyst_creep_cell_t){HYST_Q31_MAX / 50, HYST_Q31_MAX / 1000};
    return p;
}

/* To the bit the pipeline without the curve, given the curve of the reference; and in the other modes no curve at all.
 */
static void test_the_rest_of_the_pipeline_sees_the_position(void) {
    hyst_parameters_t p = full_parameters();
    const sensor_t sensor = random_sensor();
    const hyst_compensator_t without = build(&p);
    (void)undo(&sensor, &p);
    const hyst_compensator_t with = build(&p);
    hyst_compensator_state_t state[2];
    hyst_compensator_reset(&without, &state[0]);
    hyst_compensator_reset(&with, &state[1]);
    hyst_mode_t mode = HYST_MODE_COMPENSATE;
    hyst_q31_t reference = 0;
    for (int k = 0; k < 100000; k++) {
        if (random_unit(&rng) < 0.001) {
            mode = (hyst_mode_t)(random_bits(&rng) % 4U);
        }
        reference = random_unit(&rng) < 0.001 ? random_q31(&rng) : hyst_add(reference, random_q31(&rng) / 256);
        const hyst_q31_t position =
            mode == HYST_MODE_COMPENSATE ? hyst_curve_apply(&with.reference_curve, reference) : reference;
        unsigned events[2];
        const hyst_q31_t drive = hyst_compensator_step(&without, &state[0], mode, position, &events[0]);
        TEST_ASSERT_EQUAL_INT32(drive, hyst_compensator_step(&with, &state[1], mode, reference, &events[1]));
        TEST_ASSERT_EQUAL_UINT(events[0], events[1]);
    }
}

/* At a constant reference a new curve is a new position, but the drive goes there by transition_slew a sample: a filter
 * that went on from its old input would ring instead. */
static void test_another_curve_does_not_bump(void) {
    for (int run = 0; run < 100; run++) {
        hyst_compensator_t c[2];
        for (int i = 0; i < 2; i++) {
            hyst_parameters_t p;
            hyst_parameters_default(&p);
            p.transition_slew = 1 << 20;
            p.shape_sections = 1;
            p.shape[0] = (hyst_iir_section_t){HYST_Q28_ONE / 2 * 3, -HYST_Q28_ONE, 0, -HYST_Q28_ONE / 2, 0};
            const sensor_t sensor = random_sensor();
            if (i == 1 || run % 2 == 0) { /* from none to one and back, or from one to another */
                (void)undo(&sensor, &p);
            }
            c[i] = build(&p);
        }
        const hyst_q31_t reference = random_q31(&rng) / 2;
        hyst_compensator_state_t s;
        unsigned events;
        hyst_compensator_reset(&c[0], &s);
        hyst_q31_t last = s.drive;
        for (int k = 0; k < 20000; k++) {
            const int active = k / 5000 % 2;
            if (k > 0 && k % 5000 == 0) {
                TEST_ASSERT_TRUE(hyst_compensator_adopt(&c[1 - active], &c[active], &s)); /* no memory to speak of */
            }
            const hyst_q31_t drive = hyst_compensator_step(&c[active], &s, HYST_MODE_COMPENSATE, reference, &events);
            TEST_ASSERT_TRUE(llabs((int64_t)drive - last) <= 1 << 20);
            last = drive;
        }
    }
}

static void expect(hyst_parameters_fault_t fault, hyst_parameters_error_t error, uint32_t element) {
    TEST_ASSERT_EQUAL_STRING(hyst_parameters_error_text(error), hyst_parameters_error_text(fault.error));
    TEST_ASSERT_EQUAL_STRING("reference_curve", hyst_field_text(fault.field));
    TEST_ASSERT_EQUAL_UINT32(element, fault.element);
}

/* Through the image as the amplifier gets it: what rises too little anywhere is refused there. */
static void test_the_validator_names_the_node(void) {
    hyst_parameters_t p = full_parameters(), back;
    const sensor_t sensor = random_sensor();
    uint32_t image[HYST_IMAGE_MAX_WORDS];
    hyst_compensator_t c;
    (void)undo(&sensor, &p);
    for (uint32_t i = 0; i < HYST_CURVE_NODES; i++) {
        hyst_parameters_t bad = p;
        if (i > 0) {
            bad.reference_curve[0].node[i] = bad.reference_curve[0].node[i - 1] + HYST_CURVE_MIN_RISE - 1;
        }
        const size_t length = hyst_parameters_encode(&bad, image, HYST_IMAGE_MAX_WORDS);
        TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_decode(image, length, &back).error);
        TEST_ASSERT_EQUAL_MEMORY(&bad, &back, sizeof bad);
        if (i > 0) {
            expect(hyst_parameters_build(&back, &c), HYST_PARAMETERS_NOT_INVERTIBLE, i);
        } else {
            c = build(&back);
            TEST_ASSERT_TRUE(c.reference_curved);
        }
    }
    p.reference_curve[0].node[0] = HYST_Q31_MAX; /* the widest fall that there can be */
    p.reference_curve[0].node[1] = HYST_Q31_MIN;
    expect(hyst_parameters_build(&p, &c), HYST_PARAMETERS_NOT_INVERTIBLE, 1);
    p.reference_curves = 2; /* parameters need not come from an image */
    TEST_ASSERT_EQUAL_INT(HYST_FIELD_REFERENCE_CURVES, hyst_parameters_build(&p, &c).field);
}

int main(void) {
    rng = random_start("test_reference_curve", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_the_sensor_reads_the_reference);
    RUN_TEST(test_the_drive_rises_with_the_reference);
    RUN_TEST(test_the_rest_of_the_pipeline_sees_the_position);
    RUN_TEST(test_another_curve_does_not_bump);
    RUN_TEST(test_the_validator_names_the_node);
    return UNITY_END();
}
