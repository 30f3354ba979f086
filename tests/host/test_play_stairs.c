/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The staircase is the plain loop over play operators, but for rounding, whatever the history. */
#include "elements/play_stairs.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>

enum { MOST = 300, BANKS = 300, SAMPLES = 2000 };

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

typedef struct {
    size_t operators;
    double weight[MOST], threshold[MOST], memory[MOST], play[MOST];
} bank_t;

/* Thresholds at any distances, weights of both signs, a memory that is nested: as far apart as thresholds allow, or
 * less, or none. */
static void make(bank_t *bank) {
    bank->operators = (size_t)random_between(&rng, 1, MOST);
    const double curl = random_unit(&rng) < 0.3 ? 0.0 : 1.0;
    double threshold = 0.0, memory = curl * (double)random_between(&rng, -10, 10);
    for (size_t i = 0; i < bank->operators; i++) {
        const double distance = 0.001 + random_unit(&rng);
        threshold += distance;
        memory += curl * (random_unit(&rng) < 0.5 ? 1.0 : random_unit(&rng)) * (random_unit(&rng) < 0.5 ? -1.0 : 1.0) *
                  0.999 * distance;
        bank->weight[i] = random_unit(&rng) - 0.3;
        bank->threshold[i] = threshold;
        bank->memory[i] = bank->play[i] = memory;
    }
}

static double plain(bank_t *bank, double drive, double *size) {
    double sum = 0.0;
    *size = 0.0;
    for (size_t i = 0; i < bank->operators; i++) {
        bank->play[i] = fmin(fmax(bank->play[i], drive - bank->threshold[i]), drive + bank->threshold[i]);
        sum += bank->weight[i] * bank->play[i];
        *size += fabs(bank->weight[i]) * (fabs(bank->play[i]) + bank->threshold[i]);
    }
    return sum;
}

/* Ramps, ever smaller reversals, jumps, rests, and drives that meet a corner exactly. */
static double next_drive(const bank_t *bank, double drive, double *swing) {
    const double range = 1.5 * bank->threshold[bank->operators - 1];
    switch (random_between(&rng, 0, 5)) {
    case 0:
        *swing = range;
        return range * (2.0 * random_unit(&rng) - 1.0);
    case 1:
    case 2:
        *swing *= -random_unit(&rng);
        return *swing;
    case 3: {
        const size_t i = (size_t)random_between(&rng, 0, (int32_t)bank->operators - 1);
        return bank->play[i] + (random_unit(&rng) < 0.5 ? -1.0 : 1.0) * bank->threshold[i];
    }
    case 4:
        return drive;
    default:
        return drive + 0.01 * range * (random_unit(&rng) - 0.4);
    }
}

static void test_it_is_the_plain_loop(void) {
    static bank_t bank;
    for (int k = 0; k < BANKS; k++) {
        make(&bank);
        void *memory = malloc(play_stairs_bytes(bank.operators));
        play_stairs_t stairs;
        play_stairs_open(&stairs, memory, bank.operators, bank.weight, bank.threshold);
        TEST_ASSERT_TRUE(play_stairs_settle(&stairs, bank.weight, bank.memory));
        double drive = 0.0, swing = 1.0;
        for (int sample = 0; sample < SAMPLES; sample++) {
            double size;
            drive = next_drive(&bank, drive, &swing);
            const double expected = plain(&bank, drive, &size);
            /* Sums of up to 300 terms in another order: 300 roundings of 1.1e-16 of their size at most. */
            TEST_ASSERT_DOUBLE_WITHIN(1e-13 * (1.0 + size), expected, play_stairs_move(&stairs, drive));
            TEST_ASSERT_TRUE(stairs.runs <= bank.operators);
        }
        free(memory);
    }
}

static void test_a_memory_that_is_not_nested_is_refused(void) {
    const double weight[2] = {1.0, 1.0}, threshold[2] = {1.0, 2.0}, memory[2] = {0.0, 1.5};
    void *room = malloc(play_stairs_bytes(2));
    play_stairs_t stairs;
    play_stairs_open(&stairs, room, 2, weight, threshold);
    TEST_ASSERT_FALSE(play_stairs_settle(&stairs, weight, memory));
    free(room);
}

int main(void) {
    UNITY_BEGIN();
    rng = random_start("test_play_stairs", 20261123);
    RUN_TEST(test_it_is_the_plain_loop);
    RUN_TEST(test_a_memory_that_is_not_nested_is_refused);
    return UNITY_END();
}
