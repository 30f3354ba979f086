/* SPDX-License-Identifier: MIT */
#include "amplifier.h"
#include "loop/loop.h"
#include "modbus/modbus_server.h"
#include "protection/health_watch.h"
#include "registers/registers.h"
#include "store/event_log.h"
#include "store/parameter_store.h"

static uint32_t accepted;     /* requests, when a master was last heard */
static uint32_t last_samples; /* when the hardware watchdog was last fed */

void amplifier_init(const board_start_t *start) {
    const line_settings_t line = parameter_store_line(start->default_line);
    loop_init(parameter_store_init(line.baud), start->faults);
    event_log_init(start->reset_cause);
    modbus_server_init(&line);
    registers_init(start, &line);
    accepted = modbus_server_accepted();
    last_samples = loop_samples();
}

bool amplifier_serve(void) {
    health_watch_main_turned();
    const bool served = modbus_server_poll();
    if (modbus_server_accepted() != accepted) {
        accepted = modbus_server_accepted();
        loop_master_heard();
    }
    loop_settle();
    event_log_poll();
    parameter_store_check();
    /* Here the main loop lives, and this asks whether the interrupt does. */
    if (loop_samples() != last_samples) {
        last_samples = loop_samples();
        board_watchdog_feed();
    }
    return served;
}
