/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/compile_stop_bank.h"
#include "elements/stop_bank.h"
#include <stdlib.h>

bool stop_bank_compile(compile_job_t *job, const parameter_t *parameter) {
    const stop_bank_t bank = stop_bank_of(parameter);
    play_bank_t play = {.weight = allocate(bank.operators + 1, sizeof(double)),
                        .threshold = allocate(bank.operators, sizeof(double))};
    double sum = 0.0;
    bool good;
    stop_bank_to_play(&bank, &play);
    for (size_t i = 0; i <= play.operators; i++) {
        sum += play.weight[i];
    }
    /* Plays of a drive less an offset are plays of the drive, less the offset. */
    good = compile_play_bank(job, -parameter[STOP_OFFSET].value[0] * sum, play.operators, play.weight, play.threshold);
    free(play.weight);
    free(play.threshold);
    return good;
}
