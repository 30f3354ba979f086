/* SPDX-License-Identifier: MIT */
#include "amplifier.h"
#include "board.h"
#include "loop.h"
#include "modbus_server.h"
#include "parameter_store.h"
#include "register_table.h"
#include "registers.h"

void amplifier_init(uint16_t faults) {
    loop_init(parameter_store_init(), faults);
    modbus_server_init();
    registers_init();
}

static void watch(void) {
    uint16_t limit_ms;
    registers_read(ADDRESS_watchdog, 1, &limit_ms);
    const bool moving = loop_mode() != HYST_MODE_PARK || loop_conditioning();
    if (limit_ms != 0 && moving && board_microseconds() - modbus_server_last_request() > limit_ms * 1000U) {
        loop_park_by_watchdog();
    }
}

bool amplifier_serve(void) {
    const bool served = modbus_server_poll();
    watch();
    return served;
}
