/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Description of the hysteresis in a parameter image. */
#ifndef HYSTERESIS_TEXT_H
#define HYSTERESIS_TEXT_H

#include "hyst/parameters.h"

/** "prandtl_ishlinskii", "preisach", "bouc_wen", "modified_play"; never NULL. */
const char *hysteresis_name(const hyst_parameters_t *parameters);

/** The elements of the hysteresis: play operators, intervals, cells, or divisions. */
const char *hysteresis_parts(const hyst_parameters_t *parameters);
/** How many of them there are. */
uint32_t hysteresis_size(const hyst_parameters_t *parameters);

/** One line such as "prandtl_ishlinskii: 12 play operators, rate-independent". */
void hysteresis_text(const hyst_parameters_t *parameters, char text[120]);

#endif
