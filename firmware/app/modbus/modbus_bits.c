/* SPDX-License-Identifier: MIT */
#include "modbus/modbus_bits.h"
#include "loop/loop.h"
#include "registers/control.h"
#include <string.h>

bool modbus_coil(void) {
    return loop_armed();
}

uint16_t modbus_coil_command(bool on) {
    return on ? COMMAND_ARM : COMMAND_DISARM;
}

static void put(uint8_t *bits, unsigned first, uint32_t word, unsigned count) {
    for (unsigned i = 0; i < count; i++) {
        const unsigned at = first + i;
        bits[at / 8U] |= (uint8_t)((word >> i & 1U) << at % 8U);
    }
}

void modbus_discrete_inputs(uint8_t bits[(MODBUS_DISCRETE_INPUTS + 7U) / 8U]) {
    telemetry_t t;
    telemetry_read(&t);
    memset(bits, 0, (MODBUS_DISCRETE_INPUTS + 7U) / 8U);
    put(bits, 0, t.faults_live, 16);
    put(bits, 16, t.faults_sticky, 16);
    put(bits, 32, t.limits_live, 16);
    put(bits, 48, t.limits_sticky, 16);
    put(bits, 64, loop_armed() ? 1U : 0U, 1);
    put(bits, 65, loop_ready() ? 1U : 0U, 1);
    put(bits, 66, t.amplifier_state == AMPLIFIER_RUN ? 1U : 0U, 1);
    put(bits, 67, t.amplifier_state == AMPLIFIER_CONDITIONING ? 1U : 0U, 1);
    put(bits, 68, t.amplifier_state == AMPLIFIER_FAULT ? 1U : 0U, 1);
}
