/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/nuisance/linear_outputs.h"
#include "base/failure.h"
#include "elements/preisach_grid.h"
#include <gsl/gsl_cblas.h>
#include <stdlib.h>
#include <string.h>

/* Samples whose plays are weighed together. */
enum { WEIGHED = 128 };

/* The plays of a bank, and the drive itself before them. */
typedef struct {
    size_t plays;
    const double *threshold;
    double *play;          /* now */
    double *state, *weigh; /* [sample][1 + plays] of some samples; [number][1 + plays] */
    double *output;        /* [sample][number] */
} bank_t;

/* The sums of what the completed branches put out, and that of the last one, as preisach_output_next has them, for all
 * functions of the table at once. */
typedef struct {
    preisach_grid_t grid;
    preisach_memory_t memory;
    double *function;                          /* [element][number] */
    double *sum;                               /* [branches before][number] */
    double *output;                            /* [number] */
    double reversal_v[PREISACH_MAX_REVERSALS]; /* that the sums are of */
    size_t known;
} relays_t;

struct linear_outputs {
    const model_block_t *hysteresis;
    size_t numbers;
    size_t *number; /* of all, those it is linear in */
    bool of_plays;
    union {
        bank_t bank;
        relays_t *relays;
    };
};

static bool weighs_plays(const block_t *block, size_t parameter) {
    return block->operators == OPERATORS_PLAYS && strcmp(block->parameter[parameter].name, "weights") == 0;
}

/* What a number gives an element of its parameter. */
static double factor_of(const hysteresis_number_t *number, size_t element) {
    return number->factor != NULL ? number->factor[element] : 1.0;
}

static void open_bank(linear_outputs_t *linear, const hysteresis_numbers_t *numbers) {
    const parameter_t *threshold = model_parameter(linear->hysteresis, "thresholds_v");
    const size_t width = 1 + threshold->count;
    bank_t *bank = &linear->bank;
    *bank = (bank_t){.plays = threshold->count,
                     .threshold = threshold->value,
                     .play = allocate(width, sizeof(double)),
                     .state = allocate(WEIGHED * width, sizeof(double)),
                     .weigh = allocate(linear->numbers * width, sizeof(double)),
                     .output = allocate(WEIGHED * linear->numbers, sizeof(double))};
    for (size_t n = 0; n < linear->numbers; n++) {
        const hysteresis_number_t *number = &numbers->number[linear->number[n]];
        for (size_t e = 0; e < number->elements; e++) {
            bank->weigh[n * width + number->first + e] = factor_of(number, e);
        }
    }
}

static void open_relays(linear_outputs_t *linear, const hysteresis_numbers_t *numbers) {
    const parameter_t *levels = model_parameter(linear->hysteresis, "levels_v"),
                      *table = model_parameter(linear->hysteresis, "everett_um");
    const size_t n = linear->numbers;
    relays_t *relays = linear->relays = allocate(1, sizeof *relays);
    relays->grid = (preisach_grid_t){.levels = levels->count, .level_v = levels->value};
    relays->function = allocate(table->count * n, sizeof(double));
    relays->sum = allocate((PREISACH_MAX_REVERSALS + 1) * n, sizeof(double));
    relays->output = allocate(n, sizeof(double));
    for (size_t f = 0; f < n; f++) {
        const hysteresis_number_t *number = &numbers->number[linear->number[f]];
        for (size_t e = 0; e < number->elements; e++) {
            relays->function[(number->first + e) * n + f] = factor_of(number, e);
        }
    }
    cblas_daxpy((int)n, -0.5, relays->function + preisach_element(levels->count - 1, 0) * n, 1, relays->sum, 1);
}

linear_outputs_t *linear_outputs_open(const model_block_t *hysteresis, const hysteresis_numbers_t *numbers) {
    linear_outputs_t *linear = allocate(1, sizeof *linear);
    linear->hysteresis = hysteresis;
    linear->number = allocate(numbers->count + 1, sizeof(size_t));
    for (size_t n = 0; n < numbers->count; n++) {
        const size_t parameter = (size_t)(numbers->number[n].parameter - numbers->block->parameter);
        const bool of_plays = weighs_plays(hysteresis->block, parameter);
        if (of_plays || hysteresis_is_table(hysteresis, parameter)) {
            linear->of_plays = of_plays;
            linear->number[linear->numbers++] = n;
        }
    }
    if (linear->numbers == 0) {
        free(linear->number);
        free(linear);
        return NULL;
    }
    if (linear->of_plays) {
        open_bank(linear, numbers);
    } else {
        open_relays(linear, numbers);
    }
    return linear;
}

void linear_outputs_close(linear_outputs_t *linear) {
    if (linear == NULL) {
        return;
    }
    if (linear->of_plays) {
        free(linear->bank.play);
        free(linear->bank.state);
        free(linear->bank.weigh);
        free(linear->bank.output);
    } else {
        free(linear->relays->function);
        free(linear->relays->sum);
        free(linear->relays->output);
        free(linear->relays);
    }
    free(linear->number);
    free(linear);
}

bool linear_outputs_has(const linear_outputs_t *linear, size_t number) {
    for (size_t n = 0; linear != NULL && n < linear->numbers; n++) {
        if (linear->number[n] == number) {
            return true;
        }
    }
    return false;
}

static void move_plays(const bank_t *bank, double drive_v) {
    for (size_t i = 0; i < bank->plays; i++) {
        const double low = drive_v - bank->threshold[i], high = drive_v + bank->threshold[i];
        const double above = bank->play[i] > low ? bank->play[i] : low;
        bank->play[i] = above < high ? above : high;
    }
}

static void settle_bank(const linear_outputs_t *linear, const signal_t *signal) {
    const parameter_t *memory = model_parameter(linear->hysteresis, "initial_memory_v");
    for (size_t p = 0; p < linear->bank.plays; p++) {
        linear->bank.play[p] = memory->count > 0 ? memory->value[p] : 0.0;
    }
    move_plays(&linear->bank, signal->value - signal->slack_v);
}

/* As the chain leads the block (chain_stage_values). */
static void run_bank(const linear_outputs_t *linear, const signal_t *signal, size_t samples, double *const *column) {
    const bank_t *bank = &linear->bank;
    const size_t width = 1 + bank->plays, numbers = linear->numbers;
    for (size_t from = 0; from < samples; from += WEIGHED) {
        const size_t some = samples - from < WEIGHED ? samples - from : WEIGHED;
        for (size_t k = 0; k < some; k++) {
            const signal_t *now = &signal[from + k];
            if (now->turned && now->slack_v == 0.0) {
                move_plays(bank, now->turn_v);
            }
            move_plays(bank, now->value - now->slack_v);
            bank->state[k * width] = now->value;
            memcpy(bank->state + k * width + 1, bank->play, bank->plays * sizeof(double));
        }
        cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)some, (int)numbers, (int)width, 1.0, bank->state,
                    (int)width, bank->weigh, (int)width, 0.0, bank->output, (int)numbers);
        for (size_t k = 0; k < some; k++) {
            for (size_t n = 0; n < numbers; n++) {
                column[linear->number[n]][from + k] = bank->output[k * numbers + n];
            }
        }
    }
}

static void settle_relays(const linear_outputs_t *linear, const signal_t *signal) {
    const parameter_t *past = model_parameter(linear->hysteresis, "past_v");
    relays_t *relays = linear->relays;
    preisach_memory_settle(&relays->memory, &relays->grid, past->value, past->count);
    preisach_memory_move(&relays->memory, &relays->grid, signal->value);
    relays->known = 0;
}

/* output: what was put out before the branch; gets what the branch adds to it. */
static void add_branch(const relays_t *relays, size_t numbers, double to_v, double from_v, double *output) {
    const preisach_terms_t terms = preisach_terms(&relays->grid, to_v, from_v);
    for (size_t t = 0; t < terms.count; t++) {
        const double *function = relays->function + terms.element[t] * numbers, factor = terms.factor[t];
        for (size_t n = 0; n < numbers; n++) {
            output[n] += factor * function[n];
        }
    }
}

static void put_out(relays_t *relays, size_t numbers) {
    const preisach_memory_t *memory = &relays->memory;
    const size_t bytes = numbers * sizeof(double);
    double last_v = relays->grid.level_v[0];
    size_t same = 0;
    while (same < relays->known && same < memory->reversals && relays->reversal_v[same] == memory->reversal_v[same]) {
        last_v = memory->reversal_v[same++];
    }
    for (; same < memory->reversals; same++) {
        double *sum = relays->sum + (same + 1) * numbers;
        memcpy(sum, relays->sum + same * numbers, bytes);
        add_branch(relays, numbers, memory->reversal_v[same], last_v, sum);
        relays->reversal_v[same] = last_v = memory->reversal_v[same];
    }
    relays->known = same;
    memcpy(relays->output, relays->sum + same * numbers, bytes);
    add_branch(relays, numbers, memory->drive_v, last_v, relays->output);
}

static bool run_relays(const linear_outputs_t *linear, const signal_t *signal, size_t samples, double *const *column) {
    relays_t *relays = linear->relays;
    put_out(relays, linear->numbers);
    for (size_t k = 0; k < samples; k++) {
        if (signal[k].slack_v != 0.0) {
            return false;
        }
        if (signal[k].turned) {
            preisach_memory_move(&relays->memory, &relays->grid, signal[k].turn_v);
        }
        if (signal[k].turned || signal[k].value != relays->memory.drive_v) {
            preisach_memory_move(&relays->memory, &relays->grid, signal[k].value);
            put_out(relays, linear->numbers);
        }
        for (size_t n = 0; n < linear->numbers; n++) {
            column[linear->number[n]][k] = relays->output[n];
        }
    }
    return true;
}

bool linear_outputs_run(linear_outputs_t *linear, const signal_t *signal, size_t samples, double *const *column) {
    if (linear->of_plays) {
        settle_bank(linear, &signal[0]);
        run_bank(linear, signal + 1, samples, column);
        return true;
    }
    settle_relays(linear, &signal[0]);
    return signal[0].slack_v == 0.0 && run_relays(linear, signal + 1, samples, column);
}
