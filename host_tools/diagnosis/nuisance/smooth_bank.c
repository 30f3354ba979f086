/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/smooth_bank.h"
#include "numerics/least_squares.h"
#include "numerics/splines.h"
#include <math.h>
#include <stdlib.h>

enum { OPERATORS = 96, CURVE_POINTS = 200 };
_Static_assert((int)OPERATORS > (int)SMOOTH_BANK_OPERATORS, "it changes smoothly");

/* The part of the range of thresholds that an operator stands for. */
static double width_of(const double *threshold_v, size_t operators, size_t i) {
    const double below = i > 0 ? 0.5 * (threshold_v[i - 1] + threshold_v[i]) : 0.0;
    const double above = i + 1 < operators ? 0.5 * (threshold_v[i] + threshold_v[i + 1]) : threshold_v[i];
    return above - below;
}

void smooth_bank_function(const double *threshold_v, size_t operators, size_t function, double *change) {
    const double most_v = threshold_v[operators - 1];
    for (size_t i = 0; i < operators; i++) {
        const double x = sqrt(threshold_v[i] / most_v) * (SMOOTH_BANK_FUNCTIONS - 2);
        change[i] = width_of(threshold_v, operators, i) / most_v * spline(function, x);
    }
}

/* The initial curve at a drive: rising from rest. */
static double initial_curve(const double *threshold_v, const double *weight, size_t operators, double drive_v) {
    double sum = 0.0;
    for (size_t i = 0; i < operators && threshold_v[i] < drive_v; i++) {
        sum += weight[i] * (drive_v - threshold_v[i]);
    }
    return sum;
}

/* Weights of the fine bank, w_0 first, whose initial curve comes nearest to the bank's. */
static bool nearest(const model_block_t *bank, const double *threshold_v, double *weight, failure_t *failure) {
    enum { UNKNOWNS = 1 + SMOOTH_BANK_FUNCTIONS };
    const parameter_t *own = model_parameter(bank, "thresholds_v"), *weights = model_parameter(bank, "weights");
    double *columns = allocate((size_t)UNKNOWNS * CURVE_POINTS, sizeof(double)), curve[CURVE_POINTS];
    double *function = allocate((size_t)SMOOTH_BANK_FUNCTIONS * OPERATORS, sizeof(double));
    double lower[UNKNOWNS] = {0.0}, factor[UNKNOWNS];
    for (size_t k = 0; k < CURVE_POINTS; k++) {
        const double drive_v = 1.2 * threshold_v[OPERATORS - 1] * (double)(k + 1) / CURVE_POINTS;
        curve[k] = weights->value[0] * drive_v + initial_curve(own->value, weights->value + 1, own->count, drive_v);
        columns[k] = drive_v;
    }
    for (size_t f = 0; f < SMOOTH_BANK_FUNCTIONS; f++) {
        smooth_bank_function(threshold_v, OPERATORS, f, function + f * OPERATORS);
        for (size_t k = 0; k < CURVE_POINTS; k++) {
            columns[(f + 1) * CURVE_POINTS + k] =
                initial_curve(threshold_v, function + f * OPERATORS, OPERATORS, columns[k]);
        }
    }
    const bool good = fit_columns(columns, curve, CURVE_POINTS, UNKNOWNS, lower, factor, failure);
    if (good) {
        weight[0] = factor[0];
        for (size_t i = 0; i < OPERATORS; i++) {
            weight[1 + i] = 0.0;
            for (size_t f = 0; f < SMOOTH_BANK_FUNCTIONS; f++) {
                weight[1 + i] += factor[1 + f] * function[f * OPERATORS + i];
            }
        }
    }
    free(columns);
    free(function);
    return good;
}

/* Memories of the operators between those that the bank had. */
static void divide_memory(model_block_t *bank, const double *threshold_v) {
    const parameter_t *own = model_parameter(bank, "thresholds_v"), *memory = model_parameter(bank, "initial_memory_v");
    double memory_v[OPERATORS];
    if (memory->count == 0) {
        return;
    }
    for (size_t i = 0, next = 0; i < OPERATORS; i++) {
        while (next < own->count && own->value[next] < threshold_v[i]) {
            next++;
        }
        if (next == 0 || next == own->count) {
            memory_v[i] = memory->value[next == 0 ? 0 : own->count - 1];
        } else {
            const double below = own->value[next - 1], part = (threshold_v[i] - below) / (own->value[next] - below);
            memory_v[i] = (1.0 - part) * memory->value[next - 1] + part * memory->value[next];
        }
    }
    model_set_array(bank, "initial_memory_v", OPERATORS, memory_v, NULL);
}

bool smooth_bank_from(model_block_t *bank, failure_t *failure) {
    const parameter_t *own = model_parameter(bank, "thresholds_v");
    const double most_v = own->value[own->count - 1];
    double threshold_v[OPERATORS], weight[1 + OPERATORS];
    for (size_t i = 0; i < OPERATORS; i++) {
        threshold_v[i] = most_v * pow((double)(i + 1) / OPERATORS, 1.5);
    }
    if (!nearest(bank, threshold_v, weight, failure)) {
        return false;
    }
    divide_memory(bank, threshold_v);
    model_set_array(bank, "weights", 1 + OPERATORS, weight, NULL);
    model_set_array(bank, "thresholds_v", OPERATORS, threshold_v, NULL);
    return true;
}
