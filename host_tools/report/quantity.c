/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/quantity.h"
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
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
static void append_name(char text[DIAGNOSIS_LINE], const char *name) {
    static const char *const endings[] = {"_um_per_v", "_per_s", "_s", "_hz", "_um", "_v", "_n"};
    const size_t before = strlen(text);
    size_t length = strlen(name);
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        const size_t ending = strlen(endings[i]);
        if (length > ending && strcmp(name + length - ending, endings[i]) == 0) {
            length -= ending;
            break;
        }
    }
    text_append(text, "%.*s", (int)length, name);
    for (char *at = text + before; *at != '\0'; at++) {
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

void quantity_append(char text[DIAGNOSIS_LINE], const char *name, const char *unit, double value, double sigma) {
    enum { MOST_DECIMALS = 9 };
    double size;
    const bool known = isfinite(sigma) && sigma > 0.0;
    const char *shown = scale(unit, fmax(fabs(value), known ? sigma : 0.0), &size);
    append_name(text, name);
    if (known) {
        const double error = sigma / size;
        int decimals = decimals_of(error);
        const double tens = decimals < 0 ? pow(10.0, -decimals) : 1.0;
        decimals = decimals < 0 ? 0 : decimals > MOST_DECIMALS ? MOST_DECIMALS : decimals;
        text_append(text, " %.*f +- %.*f", decimals, tens > 1.0 ? round(value / size / tens) * tens : value / size,
                    decimals, tens > 1.0 ? round(error / tens) * tens : error);
    } else {
        text_append(text, " %.4g", value / size);
    }
    if (strcmp(shown, "1") != 0) {
        text_append(text, " %s", shown);
    }
}
