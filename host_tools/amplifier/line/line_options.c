/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/line/line_options.h"
#include "store/parameter_store.h"
#include <string.h>

static const char *const parities[] = {
    [LINE_PARITY_NONE] = "none", [LINE_PARITY_EVEN] = "even", [LINE_PARITY_ODD] = "odd"};
#define PARITIES ((int)(sizeof parities / sizeof parities[0]))

int parity_number(const char *name) {
    int number = PARITIES - 1;
    while (number >= 0 && strcmp(name, parities[number]) != 0) {
        number--;
    }
    return number;
}

const char *parity_name(int64_t number) {
    return number >= 0 && number < PARITIES ? parities[number] : "unknown";
}

bool device_options_check(const device_options_t *options, failure_t *failure) {
    static const unsigned long rates[] = {1200,  2400,   4800,   9600,   19200,  38400,
                                          57600, 115200, 230400, 460800, 500000, 921600};
    if (options->port == NULL && !options->port_optional) {
        return fail(failure, "--port DEV is missing");
    }
    if (options->port != NULL && options->port[0] == '\0') {
        return fail(failure, "--port is empty: it takes the name of a serial port");
    }
    bool known = false;
    for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++) {
        known = known || options->baud == rates[i];
    }
    if (!known) {
        return fail(failure, "--baud %lu: not a rate of a serial port", options->baud);
    }
    if (options->slave < 1 || options->slave > 247) {
        return fail(failure, "--slave %lu: outside 1..247", options->slave);
    }
    if (parity_number(options->parity) < 0) {
        return fail(failure, "--parity %s: not none, even or odd", options->parity);
    }
    if (options->timeout_s < 0.01 || options->timeout_s > 60.0) {
        return fail(failure, "--timeout %g: outside 0.01..60 s", options->timeout_s);
    }
    return true;
}
