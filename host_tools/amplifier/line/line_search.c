/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/line/line_search.h"
#include "registers/register_table.h"
#include "store/parameter_store.h"
#include <math.h>
#include <string.h>

/* An answer of one register takes 20 ms at 9600 baud, and the adapter of a USB port 16 ms. */
#define ANSWER_S 0.1

static bool answers(const device_options_t *at) {
    serial_line_t line;
    failure_t ignored;
    uint16_t magic = 0;
    const request_t request = {
        .what = "register magic", .address = register_table[INDEX_magic].address, .count = 1, .read = &magic};
    const bool answered =
        serial_line_open(&line, at, &ignored) && serial_line_request(&line, &request, 1, NULL, &ignored) == LINE_DONE;
    serial_line_close(&line);
    return answered && magic == REGISTERS_MAGIC;
}

/* Whether one answers at one of the rates and parities, but for those of `options` itself. */
static bool at_address(const device_options_t *options, unsigned long address, device_options_t *found) {
    static const unsigned long rates[] = {115200, 9600, 19200, 38400, 57600, 230400, 460800, 500000};
    for (size_t r = 0; r < sizeof rates / sizeof rates[0]; r++) {
        for (int parity = LINE_PARITY_NONE; parity <= LINE_PARITY_ODD; parity++) {
            *found = *options;
            found->slave = address;
            found->baud = rates[r];
            found->parity = parity_name(parity);
            found->timeout_s = fmin(options->timeout_s, ANSWER_S);
            const bool asked = address == options->slave && found->baud == options->baud &&
                               strcmp(found->parity, options->parity) == 0;
            if (!asked && answers(found)) {
                found->timeout_s = options->timeout_s;
                return true;
            }
        }
    }
    return false;
}

bool line_search(const device_options_t *options, device_options_t *found) {
    const unsigned long first = 1; /* as delivered */
    return at_address(options, options->slave, found) || (options->slave != first && at_address(options, first, found));
}
