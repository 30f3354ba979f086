/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "compile/hysteresis_text.h"
#include <stdbool.h>
#include <stdio.h>

typedef struct {
    const char *name, *parts;
} words_t;

static const words_t *words(const hyst_parameters_t *parameters) {
    static const words_t all[HYST_FAMILY_COUNT] = {
        [HYST_FAMILY_PRANDTL_ISHLINSKII] = {"prandtl_ishlinskii", "play operators"},
        [HYST_FAMILY_PREISACH] = {"preisach", "intervals"},
        [HYST_FAMILY_BOUC_WEN] = {"bouc_wen", "cells"},
        [HYST_FAMILY_MODIFIED_PLAY] = {"modified_play", "divisions"},
    };
    static const words_t unknown = {"unknown family", "parts"};
    return parameters->family < HYST_FAMILY_COUNT ? &all[parameters->family] : &unknown;
}

const char *hysteresis_name(const hyst_parameters_t *parameters) {
    return words(parameters)->name;
}

const char *hysteresis_parts(const hyst_parameters_t *parameters) {
    return words(parameters)->parts;
}

uint32_t hysteresis_size(const hyst_parameters_t *parameters) {
    switch (parameters->family) {
    case HYST_FAMILY_PREISACH:
        return parameters->preisach_intervals;
    case HYST_FAMILY_BOUC_WEN:
        return parameters->bouc_wen_cells;
    case HYST_FAMILY_MODIFIED_PLAY:
        return parameters->modified_plays > 0 ? parameters->modified_play[0].divisions : 0;
    default:
        return parameters->pi_operators;
    }
}

static bool rate_dependent(const hyst_parameters_t *parameters) {
    const hyst_modified_play_parameters_t *plane = &parameters->modified_play[0];
    return parameters->pi_beta > 0 || (parameters->modified_plays > 0 && (plane->alpha > 0 || plane->beta > 0));
}

void hysteresis_text(const hyst_parameters_t *parameters, char text[120]) {
    (void)snprintf(text, 120, "%s: %u %s, %s", hysteresis_name(parameters), (unsigned)hysteresis_size(parameters),
                   hysteresis_parts(parameters), rate_dependent(parameters) ? "rate-dependent" : "rate-independent");
}
