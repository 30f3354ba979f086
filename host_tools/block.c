/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "block.h"

void *block_open(const block_t *block, const parameter_t *parameter, const stage_setup_t *setup) {
    const size_t further = block->further_bytes != NULL ? block->further_bytes(parameter, setup) : 0;
    void *state = allocate(block->state_bytes + further, 1);
    block->open(state, parameter, setup);
    return state;
}
