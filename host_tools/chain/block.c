/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/block.h"

bool check_operators(const parameter_t bank[3], failure_t *failure) {
    const size_t weights = bank[0].count, operators = bank[1].count, memories = bank[2].count;
    if (weights != operators + 1) {
        return fail(failure, "%zu weights for %zu thresholds, there must be one weight more", weights, operators);
    }
    return memories == 0 || memories == operators ||
           fail(failure, "%zu values of initial memory for %zu thresholds", memories, operators);
}

void *block_open(const block_t *block, const parameter_t *parameter, const stage_setup_t *setup) {
    const size_t further = block->further_bytes != NULL ? block->further_bytes(parameter, setup) : 0;
    void *state = allocate(block->state_bytes + further, 1);
    block->open(state, parameter, setup);
    return state;
}
