/* SPDX-License-Identifier: MIT */
/*
 * What an image is said to cost, against what the emulated processor counted (tests/conformance/budget.txt): never less
 * than the worst that was observed, with what further signals of the capture take, and not so much more that images are
 * refused for nothing.
 */
#include "hyst/cost.h"
#include "unity.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Rounding up, and what a full stack of everything at once takes that no history of the budget needed. */
#define MOST_ABOVE 145U /* percent */

typedef struct {
    char kind[16], capture[16], family[16], extras[16];
    unsigned size, sections, cells;
    uint32_t worst;
} line_t;

static line_t budget[400];
static unsigned lines;

static unsigned number(const char *word) {
    return word != NULL ? (unsigned)strtoul(word, NULL, 10) : 0U;
}

static void copy(char to[16], const char *word) {
    (void)snprintf(to, 16, "%s", word != NULL ? word : "");
}

/* "sample play_rate 16 4 0 plain 1043", "signals all play 0 0 0 plain 713", "source sweep 638". */
static void read_line(char *text, line_t *l) {
    const char *const blanks = " \n";
    l->worst = number(strrchr(text, ' '));
    copy(l->kind, strtok(text, blanks));
    if (strcmp(l->kind, "signals") == 0 || strcmp(l->kind, "source") == 0) {
        copy(l->capture, strtok(NULL, blanks));
    }
    copy(l->family, strtok(NULL, blanks));
    l->size = number(strtok(NULL, blanks));
    l->sections = number(strtok(NULL, blanks));
    l->cells = number(strtok(NULL, blanks));
    copy(l->extras, strtok(NULL, blanks));
}

static void read_budget(void) {
    FILE *file = fopen(BUDGET, "r");
    char text[200];
    TEST_ASSERT_NOT_NULL_MESSAGE(file, BUDGET);
    while (fgets(text, sizeof text, file) != NULL) {
        TEST_ASSERT_LESS_THAN_UINT(sizeof budget / sizeof budget[0], lines);
        read_line(text, &budget[lines++]);
    }
    (void)fclose(file);
}

void setUp(void) {
    lines = 0;
    read_budget();
}
void tearDown(void) {
}

static hyst_parameters_t parameters_of(const line_t *l) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    const bool extras = strcmp(l->extras, "curves") == 0;
    p.shape_sections = l->sections / 2U;
    p.equalise_sections = l->sections - l->sections / 2U;
    p.creep_cells = l->cells;
    p.drive_curves = p.reference_curves = p.inertia_sections = extras ? 1 : 0;
    if (strcmp(l->family, "preisach") == 0) {
        p.family = HYST_FAMILY_PREISACH;
        p.preisach_intervals = l->size;
    } else if (strcmp(l->family, "bouc_wen") == 0) {
        p.family = HYST_FAMILY_BOUC_WEN;
        p.bouc_wen_cells = l->size;
    } else if (strcmp(l->family, "modified_play") == 0) {
        p.family = HYST_FAMILY_MODIFIED_PLAY;
        p.modified_plays = 1;
        p.modified_play[0].divisions = l->size;
    } else {
        p.pi_operators = l->size;
    }
    return p;
}

/* What further signals take: the most of any family. */
static uint32_t further_signals(void) {
    uint32_t most = 0;
    unsigned pairs = 0;
    for (unsigned i = 0; i + 1U < lines; i++) {
        const line_t *three = &budget[i], *all = &budget[i + 1U];
        if (strcmp(three->kind, "signals") == 0 && strcmp(three->capture, "three") == 0) {
            TEST_ASSERT_EQUAL_STRING("all", all->capture);
            TEST_ASSERT_EQUAL_STRING(three->family, all->family);
            most = all->worst - three->worst > most ? all->worst - three->worst : most;
            pairs++;
        }
    }
    TEST_ASSERT_EQUAL_UINT_MESSAGE(5, pairs, "an empty image and each family with everything on");
    return most;
}

static uint32_t source(const char *name) {
    for (unsigned i = 0; i < lines; i++) {
        if (strcmp(budget[i].kind, "source") == 0 && strcmp(budget[i].capture, name) == 0) {
            return budget[i].worst;
        }
    }
    TEST_FAIL_MESSAGE(name);
    return 0;
}

static void test_no_sample_of_the_budget_costs_more_than_is_said(void) {
    const uint32_t signals = further_signals();
    unsigned samples = 0;
    for (unsigned i = 0; i < lines; i++) {
        const line_t *l = &budget[i];
        if (strcmp(l->kind, "sample") != 0) {
            continue;
        }
        const hyst_parameters_t p = parameters_of(l);
        const uint32_t said = hyst_cost_instructions(&p);
        char text[120];
        (void)snprintf(text, sizeof text, "%s %u %u %u %s", l->family, l->size, l->sections, l->cells, l->extras);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32_MESSAGE(l->worst + signals, said, text);
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE((l->worst + signals) * MOST_ABOVE / 100U, said, text);
        TEST_ASSERT_EQUAL_UINT32(HYST_COST_CYCLES_PER_INSTRUCTION * said, hyst_cost_cycles(&p));
        samples++;
    }
    TEST_ASSERT_EQUAL_UINT(30, samples);
}

static void test_sources_are_within_it_and_a_tone_costs_what_is_said(void) {
    enum { TONES = 16 };
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    const uint32_t empty = hyst_cost_instructions(&p);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(source("sweep") + further_signals(), empty);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(source("multisine") + further_signals(), empty + TONES * HYST_COST_TONE);
}

static void test_the_budget_is_what_the_clock_leaves_of_a_period(void) {
    TEST_ASSERT_EQUAL_UINT32(16800 - 537 - 24, hyst_cost_budget(168000000, 10000000));
    TEST_ASSERT_EQUAL_UINT32(6720 - 537 - 24, hyst_cost_budget(168000000, 25000000));
    TEST_ASSERT_EQUAL_UINT32(1600 - 51 - 24, hyst_cost_budget(16000000, 10000000));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, hyst_cost_budget(16000000, UINT32_MAX), "nothing is left");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(UINT32_MAX, hyst_cost_budget(UINT32_MAX, 1), "more than can be said");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_no_sample_of_the_budget_costs_more_than_is_said);
    RUN_TEST(test_sources_are_within_it_and_a_tone_costs_what_is_said);
    RUN_TEST(test_the_budget_is_what_the_clock_leaves_of_a_period);
    return UNITY_END();
}
