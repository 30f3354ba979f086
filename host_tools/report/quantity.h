/* SPDX-License-Identifier: GPL-3.0-or-later */
/** A number with its error and its unit, as one writes it by hand: "delay 0.266 +- 0.003 ms". */
#ifndef QUANTITY_H
#define QUANTITY_H

#include "report/text_line.h"

/**
 * Appends name, value, error and unit. The name is that of a parameter, without its unit ("delay_s": "delay"); the unit
 * gets the prefix with which the value is at least 1 and below 1000, where the unit takes one (s, Hz, um, V). The error
 * has one digit, two if the first is 1 or 2, and the value as many decimals; without an error above 0 the value has
 * four digits.
 */
void quantity_append(char text[DIAGNOSIS_LINE], const char *name, const char *unit, double value, double sigma);

#endif
