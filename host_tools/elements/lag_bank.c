/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/lag_bank.h"

void lag_bank_add(lag_bank_t *bank, const first_order_lag_t *lag) {
    const size_t j = bank->lags++;
    bank->held = lag->held;
    bank->output[j] = lag->output;
    bank->decay[j] = lag->decay;
    for (size_t i = 0; i < 4; i++) {
        bank->cubic[i][j] = lag->cubic[i];
    }
    for (size_t i = 0; i < 2; i++) {
        bank->line[i][j] = lag->line[i];
        bank->hold[i][j] = lag->hold[i];
    }
}

void lag_bank_settle(lag_bank_t *bank, double value) {
    for (size_t j = 0; j < bank->lags; j++) {
        bank->output[j] = value;
    }
}

static void next_held(lag_bank_t *bank, double before, double now) {
    for (size_t j = 0; j < LAG_BANK_PLACES; j++) {
        bank->output[j] = bank->decay[j] * bank->output[j] + bank->hold[0][j] * now + bank->hold[1][j] * before;
    }
}

static void next_smooth(lag_bank_t *bank, const drive_window_t *drive) {
    const double x1 = drive->x[1], x2 = drive->x[2], x3 = drive->x[3], x4 = drive->x[4], smooth = drive->smooth;
    for (size_t j = 0; j < LAG_BANK_PLACES; j++) {
        const double line = bank->line[0][j] * x2 + bank->line[1][j] * x3;
        const double cubic =
            bank->cubic[0][j] * x1 + bank->cubic[1][j] * x2 + bank->cubic[2][j] * x3 + bank->cubic[3][j] * x4;
        bank->output[j] = bank->decay[j] * bank->output[j] + line + smooth * (cubic - line);
    }
}

double lag_bank_next(lag_bank_t *bank, const drive_window_t *drive) {
    double sum = 0.0;
    if (bank->held) {
        next_held(bank, drive->x[3], drive->x[2]);
    } else {
        next_smooth(bank, drive);
    }
    for (size_t j = 0; j < bank->lags; j++) {
        sum += bank->output[j];
    }
    return sum;
}
