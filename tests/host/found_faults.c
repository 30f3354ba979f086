/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "found_faults.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

random_t rng;
scene_t scene;
recording_t recordings[2];
look_t *looks;
fault_list_t faults;
double late[SCENE_SAMPLES];

static const double errors = 4.0;

void shift_from(size_t at, double samples) {
    for (size_t k = at; k < SCENE_SAMPLES; k++) {
        late[k] += samples;
    }
}

void look_at_them(size_t count) {
    failure_t failure;
    looks = looks_at(recordings, count, &failure);
    TEST_ASSERT_NOT_NULL(looks);
    faults_find(looks, count, &faults);
}

void close_all(size_t count) {
    faults_free(&faults);
    looks_free(looks, count);
    for (size_t i = 0; i < count; i++) {
        recording_free(&recordings[i]);
    }
    scene_close(&scene);
}

double *record(size_t which) {
    scene_open(&scene, which, &rng);
    scene_record(&scene, late, &rng, &recordings[0]);
    return recordings[0].column[COLUMN_DISPLACEMENT];
}

static char message[400];

const char *found(size_t which) {
    int at = snprintf(message, sizeof message, "drive %zu:", which);
    for (size_t i = 0; i < faults.count && at < (int)sizeof message - 60; i++) {
        at += snprintf(message + at, sizeof message - (size_t)at, " %s", faults.fault[i].kind->name);
    }
    return message;
}

const fault_t *only(size_t which, const fault_kind_t *kind) {
    TEST_ASSERT_EQUAL_MESSAGE(1, faults.count, found(which));
    TEST_ASSERT_EQUAL_STRING_MESSAGE(kind->name, faults.fault[0].kind->name, found(which));
    return &faults.fault[0];
}

const fault_t *only_or_none(size_t which, const fault_kind_t *kind) {
    return faults.count == 0 ? NULL : only(which, kind);
}

const fault_number_t *number(const fault_t *fault, const char *name) {
    for (size_t i = 0; i < fault->numbers; i++) {
        if (strcmp(fault->number[i].name, name) == 0) {
            return &fault->number[i];
        }
    }
    TEST_FAIL_MESSAGE(name);
    return NULL;
}

void expect_number(const fault_t *fault, const char *name, double value) {
    const fault_number_t *n = number(fault, name);
    char text[200];
    snprintf(text, sizeof text, "%s: %g +- %g, is %g", name, n->value, n->sigma, value);
    TEST_ASSERT_TRUE_MESSAGE(fabs(n->value - value) <= errors * n->sigma + 1e-9 * fabs(value), text);
}

void expect_near(const fault_t *fault, size_t sample) {
    TEST_ASSERT_TRUE(fault->spans >= 1);
    TEST_ASSERT_TRUE(fault->span[0].from <= sample + 1 && sample <= fault->span[0].to + 1);
}
