/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/preisach_grid.h"
#include <math.h>
#include <string.h>

size_t preisach_elements(size_t levels) {
    return levels * (levels - 1) / 2;
}

size_t preisach_element(size_t i, size_t j) {
    return i * (i - 1) / 2 + j;
}

/* The interval a drive within the levels lies in, and where in it, 0 to 1. The guess is right where levels are evenly
 * spaced. */
static size_t interval_of(const preisach_grid_t *grid, double drive_v, double *part) {
    const double *level = grid->level_v;
    const size_t last = grid->levels - 2;
    const double guess = (drive_v - level[0]) / (level[last + 1] - level[0]) * (double)(last + 1);
    size_t low = guess < (double)last ? (size_t)guess : last;
    while (low > 0 && drive_v < level[low]) {
        low--;
    }
    while (low < last && drive_v >= level[low + 1]) {
        low++;
    }
    *part = (drive_v - level[low]) / (level[low + 1] - level[low]);
    return low;
}

/* Continued below the diagonal by E(j,i) = -E(i,j), the bilinear form is the linear one in the triangles. */
static void add_term(preisach_terms_t *terms, size_t i, size_t j, double factor) {
    if (i != j && factor != 0.0) {
        terms->element[terms->count] = i > j ? preisach_element(i, j) : preisach_element(j, i);
        terms->factor[terms->count++] = i > j ? factor : -factor;
    }
}

static preisach_place_t place_of(const preisach_grid_t *grid, double drive_v) {
    const double bottom = grid->level_v[0], top = grid->level_v[grid->levels - 1];
    preisach_place_t place = {.drive_v = drive_v};
    place.interval = interval_of(grid, fmax(bottom, fmin(top, drive_v)), &place.part);
    return place;
}

static preisach_terms_t terms_between(const preisach_grid_t *grid, const preisach_place_t *to,
                                      const preisach_place_t *from) {
    const size_t last = grid->levels - 1, i = to->interval, j = from->interval;
    const double *level = grid->level_v, bottom = level[0], top = level[last], p = to->part, q = from->part;
    const double to_v = to->drive_v, from_v = from->drive_v;
    preisach_terms_t terms;
    terms.count = 0;
    add_term(&terms, i, j, (1.0 - p) * (1.0 - q));
    add_term(&terms, i + 1, j, p * (1.0 - q));
    add_term(&terms, i, j + 1, (1.0 - p) * q);
    add_term(&terms, i + 1, j + 1, p * q);
    add_term(&terms, last, last - 1, (fmax(top, to_v) - fmax(top, from_v)) / (top - level[last - 1]));
    add_term(&terms, 1, 0, (fmin(bottom, to_v) - fmin(bottom, from_v)) / (level[1] - bottom));
    return terms;
}

preisach_terms_t preisach_terms(const preisach_grid_t *grid, double to_v, double from_v) {
    const preisach_place_t to = place_of(grid, to_v), from = place_of(grid, from_v);
    return terms_between(grid, &to, &from);
}

static double value_of(const preisach_terms_t *terms, const double *table) {
    double sum = 0.0;
    for (size_t t = 0; t < terms->count; t++) {
        sum += terms->factor[t] * table[terms->element[t]];
    }
    return sum;
}

double preisach_everett(const preisach_grid_t *grid, const double *table, double to_v, double from_v) {
    const preisach_terms_t terms = preisach_terms(grid, to_v, from_v);
    return value_of(&terms, table);
}

double preisach_reversible(const preisach_grid_t *grid, const double *table, double to_v, double from_v) {
    const size_t last = grid->levels - 2;
    const double *level = grid->level_v, low_v = fmin(to_v, from_v), high_v = fmax(to_v, from_v);
    double part, sum = 0.0;
    for (size_t i = interval_of(grid, fmax(low_v, level[0]), &part); i <= last; i++) {
        const double begin = i == 0 ? low_v : fmax(low_v, level[i]);
        const double end = i == last ? high_v : fmin(high_v, level[i + 1]);
        if (end <= begin) {
            break;
        }
        sum += table[preisach_element(i + 1, i)] * (end - begin) / (level[i + 1] - level[i]);
    }
    return to_v < from_v ? -sum : sum;
}

void preisach_memory_begin(preisach_memory_t *memory, const preisach_grid_t *grid) {
    memory->reversals = 0;
    memory->drive_v = grid->level_v[0];
}

static void forget_smallest(preisach_memory_t *memory) {
    double *reversal = memory->reversal_v, smallest = HUGE_VAL;
    size_t first = 0;
    for (size_t k = 0; k + 1 < memory->reversals; k++) {
        const double next = k + 2 < memory->reversals ? reversal[k + 2] : memory->drive_v;
        if (fabs(next - reversal[k]) <= smallest) {
            smallest = fabs(next - reversal[k]);
            first = k;
        }
    }
    memory->reversals -= 2;
    memmove(reversal + first, reversal + first + 2, (memory->reversals - first) * sizeof *reversal);
}

void preisach_memory_move(preisach_memory_t *memory, const preisach_grid_t *grid, double drive_v) {
    const double bottom = grid->level_v[0], top = grid->level_v[grid->levels - 1];
    const bool fell = memory->reversals % 2 == 1, rises = drive_v > memory->drive_v;
    if (drive_v == memory->drive_v) {
        return;
    }
    if (rises == fell) {
        if (memory->reversals == PREISACH_MAX_REVERSALS) {
            forget_smallest(memory);
        }
        memory->reversal_v[memory->reversals++] = fmax(bottom, fmin(top, memory->drive_v));
    }
    memory->drive_v = drive_v;
    /* Wiping out: a reversal that the drive reaches goes, together with the one after it. */
    while (memory->reversals >= 2) {
        const double older = memory->reversal_v[memory->reversals - 2];
        if (rises ? drive_v < older : drive_v > older) {
            return;
        }
        memory->reversals -= 2;
    }
    if (memory->reversals == 1 && drive_v <= bottom) {
        memory->reversals = 0;
    }
}

static void demagnetise(preisach_memory_t *memory, const preisach_grid_t *grid) {
    const size_t last = grid->levels - 1;
    preisach_memory_begin(memory, grid);
    for (size_t k = 0; 2 * k < last; k++) {
        preisach_memory_move(memory, grid, grid->level_v[k]);
        preisach_memory_move(memory, grid, grid->level_v[last - k]);
    }
}

void preisach_memory_settle(preisach_memory_t *memory, const preisach_grid_t *grid, const double *past_v, size_t past) {
    if (past == 0) {
        demagnetise(memory, grid);
        return;
    }
    preisach_memory_begin(memory, grid);
    for (size_t k = 0; k < past; k++) {
        preisach_memory_move(memory, grid, past_v[k]);
    }
}

/* The past as branches, from all relays down: k-th of memory->reversals + 1. */
static preisach_terms_t branch(const preisach_grid_t *grid, const preisach_memory_t *memory, size_t k) {
    return preisach_terms(grid, k < memory->reversals ? memory->reversal_v[k] : memory->drive_v,
                          k > 0 ? memory->reversal_v[k - 1] : grid->level_v[0]);
}

void preisach_output_row(const preisach_grid_t *grid, const preisach_memory_t *memory, double *row) {
    row[preisach_element(grid->levels - 1, 0)] -= 0.5;
    for (size_t k = 0; k <= memory->reversals; k++) {
        const preisach_terms_t terms = branch(grid, memory, k);
        for (size_t t = 0; t < terms.count; t++) {
            row[terms.element[t]] += terms.factor[t];
        }
    }
}

double preisach_output(const preisach_grid_t *grid, const double *table, double offset_um,
                       const preisach_memory_t *memory) {
    double sum = offset_um - 0.5 * table[preisach_element(grid->levels - 1, 0)];
    for (size_t k = 0; k <= memory->reversals; k++) {
        const preisach_terms_t terms = branch(grid, memory, k);
        sum += value_of(&terms, table);
    }
    return sum;
}

/* Whether the oldest `count` reversals are those of the sums. Below the last ones they change only when one was
 * forgotten. */
static bool same_reversals(const preisach_sums_t *sums, const preisach_memory_t *memory, size_t count) {
    const size_t all = memory->reversals + 4 > PREISACH_MAX_REVERSALS ? 0 : count > 1 ? count - 1 : 0;
    for (size_t k = all; k < count; k++) {
        if (sums->reversal_v[k] != memory->reversal_v[k]) {
            return false;
        }
    }
    return true;
}

double preisach_output_next(const preisach_grid_t *grid, const double *table, double offset_um,
                            const preisach_memory_t *memory, preisach_sums_t *sums) {
    size_t known = sums->known < memory->reversals ? sums->known : memory->reversals;
    while (known > 0 && !same_reversals(sums, memory, known)) {
        known--;
    }
    for (; known < memory->reversals; known++) {
        const preisach_terms_t terms = branch(grid, memory, known);
        sums->reversal_v[known] = memory->reversal_v[known];
        sums->sum[known] = (known > 0 ? sums->sum[known - 1] : 0.0) + value_of(&terms, table);
    }
    sums->known = known;
    const double from_v = known > 0 ? memory->reversal_v[known - 1] : grid->level_v[0];
    if (!sums->begun || from_v != sums->from.drive_v) { /* it stays for a whole branch */
        sums->from = place_of(grid, from_v);
        sums->begun = true;
    }
    const preisach_place_t to = place_of(grid, memory->drive_v);
    const preisach_terms_t last = terms_between(grid, &to, &sums->from);
    return offset_um - 0.5 * table[preisach_element(grid->levels - 1, 0)] + (known > 0 ? sums->sum[known - 1] : 0.0) +
           value_of(&last, table);
}
