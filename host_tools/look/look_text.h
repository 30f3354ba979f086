/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The look in plain words. */
#ifndef LOOK_TEXT_H
#define LOOK_TEXT_H

#include "look/fault.h"
#include <stdio.h>

/** What each recording shows, a few lines each, and the faults. */
void looks_print(FILE *file, const look_t *looks, size_t count, const fault_list_t *faults);

/** The same in two lines a recording, and the faults, as a diagnosis begins with it. masked: samples left out. */
void looks_print_shortly(FILE *file, const look_t *looks, size_t count, const fault_list_t *faults, size_t masked);

/** One fault as one sentence with its numbers, and what to change. */
void fault_print(FILE *file, const look_t *looks, size_t count, const fault_t *fault);

#endif
