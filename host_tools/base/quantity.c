/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/quantity.h"
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Units that take a prefix, and how each of them is called, the largest first. */
typedef struct {
    const char *unit;
    struct {
        double size;
        const char *name;
    } scaled[4];
} prefixes_t;

static const prefixes_t prefixes[] = {
    {"s", {{1.0, "s"}, {1e-3, "ms"}, {1e-6, "us"}, {1e-9, "ns"}}},
    {"Hz", {{1e6, "MHz"}, {1e3, "kHz"}, {1.0, "Hz"}, {1e-3, "mHz"}}},
    {"um", {{1e3, "mm"}, {1.0, "um"}, {1e-3, "nm"}, {1e-6, "pm"}}},
    {"V", {{1e3, "kV"}, {1.0, "V"}, {1e-3, "mV"}, {1e-6, "uV"}}},
};

static const char *scale(const char *unit, double value, double *size) {
    *size = 1.0;
    for (size_t i = 0; i < sizeof prefixes / sizeof prefixes[0] && value != 0.0; i++) {
        if (strcmp(unit, prefixes[i].unit) == 0) {
            size_t k = 0;
            while (k + 1 < 4 && fabs(value) < 0.9995 * prefixes[i].scaled[k].size) {
                k++;
            }
            *size = prefixes[i].scaled[k].size;
            return prefixes[i].scaled[k].name;
        }
    }
    return unit;
}

/* The name without what is only its unit: "_per_decade" says what it counts, and stays. */
static void spell_name(char text[QUANTITY_TEXT], const char *name) {
    static const char *const endings[] = {"_um_per_v", "_um_per_hz", "_per_hz", "_per_s", "_s",
                                          "_hz",       "_um",        "_v",      "_n"};
    size_t length = strlen(name);
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        const size_t ending = strlen(endings[i]);
        if (length > ending && strcmp(name + length - ending, endings[i]) == 0) {
            length -= ending;
            break;
        }
    }
    (void)snprintf(text, QUANTITY_TEXT, "%.*s%s", (int)length, name, length > 0 ? " " : "");
    for (char *at = text; *at != '\0'; at++) {
        *at = *at == '_' ? ' ' : *at;
    }
}

/* Decimals that show the error with one digit, or with two where the first is 1 or 2. Negative: tens are rounded. */
static int decimals_of(double sigma) {
    const double power = floor(log10(sigma)), first = sigma / pow(10.0, power);
    const double rounded = first >= 9.5 ? 10.0 : first; /* 0.98 is 1.0 */
    const int decimals = -(int)power - (rounded >= 10.0 ? 1 : 0);
    return decimals + (rounded < 2.95 || rounded >= 10.0 ? 1 : 0);
}

/* A multiple of 10^-decimals. */
static double rounded_to(double value, int decimals) {
    const double tens = pow(10.0, abs(decimals));
    const double scaled = decimals < 0 ? value / tens : value * tens;
    return !isfinite(scaled) ? value : decimals < 0 ? round(scaled) * tens : round(scaled) / tens;
}

/* Decimals with which the value has so many digits. */
static int decimals_for(double value, int digits) {
    return value == 0.0 ? 0 : digits - 1 - (int)floor(log10(fabs(value)));
}

/* Without zeros at the end. */
static void print_rounded(char *text, size_t size, double value, int decimals) {
    (void)snprintf(text, size, "%.15g", rounded_to(value, decimals) + 0.0); /* not -0 */
}

static void append_unit(char text[QUANTITY_TEXT], const char *unit) {
    const size_t length = strlen(text);
    if (strcmp(unit, "1") != 0) {
        (void)snprintf(text + length, QUANTITY_TEXT - length, " %s", unit);
    }
}

void quantity_text(char text[QUANTITY_TEXT], const char *name, const char *unit, double value, double sigma) {
    enum { MOST_DECIMALS = 9, DIGITS = 4 };
    double size;
    const bool known = isfinite(sigma) && sigma > 0.0;
    const char *shown = scale(unit, fmax(fabs(value), known ? sigma : 0.0), &size);
    spell_name(text, name);
    const size_t length = strlen(text), left = QUANTITY_TEXT - length;
    if (known) {
        const int decimals = decimals_of(sigma / size);
        const int printed = decimals < 0 ? 0 : decimals > MOST_DECIMALS ? MOST_DECIMALS : decimals;
        (void)snprintf(text + length, left, "%.*f +- %.*f", printed,
                       decimals < 0 ? rounded_to(value / size, decimals) : value / size, printed,
                       decimals < 0 ? rounded_to(sigma / size, decimals) : sigma / size);
    } else {
        const bool counted = sigma == 0.0 && strcmp(unit, "1") == 0 && value == floor(value);
        print_rounded(text + length, left, value / size, counted ? 0 : decimals_for(value / size, DIGITS));
    }
    append_unit(text, shown);
}

void quantity_named(char text[QUANTITY_TEXT], const char *name, const char *unit, double value, int digits) {
    double size;
    const char *shown = scale(unit, fabs(value), &size);
    spell_name(text, name);
    const size_t length = strlen(text);
    print_rounded(text + length, QUANTITY_TEXT - length, value / size, decimals_for(value / size, digits));
    append_unit(text, shown);
}

void quantity_range(char text[QUANTITY_TEXT], double from, double to, double resolution) {
    static const double part = 5.0;
    enum { FEWEST_DIGITS = 2, MOST_DIGITS = 7 }; /* more are what arithmetic leaves */
    const double bound[2] = {from, to}, wanted = resolution > 0.0 ? resolution : fabs(to - from) / part;
    char shown[2][QUANTITY_TEXT / 2 - 2];
    for (size_t i = 0; i < 2; i++) {
        const int decimals = wanted > 0.0 ? -(int)floor(log10(wanted)) : 0;
        const int least = decimals_for(bound[i], FEWEST_DIGITS), most = decimals_for(bound[i], MOST_DIGITS);
        const int free = decimals > least ? decimals < most ? decimals : most : least;
        print_rounded(shown[i], sizeof shown[i], bound[i], resolution > 0.0 ? decimals : free);
    }
    const bool one = strcmp(shown[0], shown[1]) == 0;
    (void)snprintf(text, QUANTITY_TEXT, "%s%s%s", shown[0], one ? "" : " .. ", one ? "" : shown[1]);
}

void quantity_time(char text[QUANTITY_TEXT], double time_s, double interval_s) {
    print_rounded(text, QUANTITY_TEXT, time_s, interval_s > 0.0 ? -(int)floor(log10(interval_s)) : 9);
}
