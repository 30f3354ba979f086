/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Numbers as one writes them by hand, with an error or a unit: "delay 266 +- 3 us", "6.22 .. 6.51". */
#ifndef QUANTITY_H
#define QUANTITY_H

/** Each function fills such a text. */
enum { QUANTITY_TEXT = 128 };

/**
 * Name, value, error and unit. The name is that of a parameter, without its unit ("delay_s": "delay"; "": none); the
 * unit gets the prefix with which the value is at least 1 and below 1000, where the unit takes one (s, Hz, um, V). The
 * error has one digit, two if the first is 1 or 2, and the value as many decimals. Without an error above 0 the value
 * has four digits; a whole number without a unit has all of them if its error is 0, for then it was counted.
 */
void quantity_text(char text[QUANTITY_TEXT], const char *name, const char *unit, double value, double sigma);

/** Name, the value with so many digits, and unit: "delay 13 ms". */
void quantity_named(char text[QUANTITY_TEXT], const char *name, const char *unit, double value, int digits);

/** Both bounds to the power of ten that is not above the resolution; 0: to a fifth of the range, and two digits at
 * least, so that the lower bound of decades is seen, and seven at most. One number where both are the same then. */
void quantity_range(char text[QUANTITY_TEXT], double from, double to, double resolution);

/** A time of a clock in s, without its unit: to the power of ten that tells samples apart, however far from 0. */
void quantity_time(char text[QUANTITY_TEXT], double time_s, double interval_s);

#endif
