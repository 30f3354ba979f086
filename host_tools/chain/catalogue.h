/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The catalogue of blocks: every physical effect that a model can contain. docs/MODELS.md has the equations. */
#ifndef CATALOGUE_H
#define CATALOGUE_H

#include "block_list.h" /* generated: every block_t of blocks/, in the order of place and .order */
#include "chain/block.h"

#define BLOCK_DECLARE(name) extern const block_t block_##name;
BLOCK_LIST(BLOCK_DECLARE)
#undef BLOCK_DECLARE

extern const block_t *const catalogue[];
extern const size_t catalogue_count;

/** The block of that name, or NULL. */
const block_t *catalogue_find(const char *name);

/** "electronics", "hysteresis", "slow", "mechanics", "sensor". */
const char *place_name(place_t place);

#endif
