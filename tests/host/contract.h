/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a block, a family, a command or a fault of recordings has to declare, so that all that works from the tables can
 * use it.
 *
 * Each function appends a line for each thing that is missing or contradicts itself, "block creep: parameter gamma: no
 * unit", to `text`, and returns how many there are. Lines that do not fit are counted all the same.
 */
#ifndef CONTRACT_H
#define CONTRACT_H

#include "chain/block.h"
#include "command_line/command_line.h"
#include "identify/family.h"
#include "look/fault.h"

enum { CONTRACT_TEXT = 8192 };

size_t contract_block(const block_t *block, char text[CONTRACT_TEXT]);
size_t contract_family(const family_t *family, char text[CONTRACT_TEXT]);
size_t contract_command(const command_t *command, char text[CONTRACT_TEXT]);
size_t contract_fault(const fault_kind_t *kind, char text[CONTRACT_TEXT]);

#endif
