/* SPDX-License-Identifier: MIT */
/**
 * From reset to main(), and what happens when the processor meets a fault. Used by every image for this chip.
 *
 * An image defines the interrupt handlers it uses under the names below; every other interrupt is a fault.
 *
 * A fault is a hard, memory, bus or usage fault, an NMI (the clock security system) or an unexpected interrupt. It
 * leaves a record in memory that a reset does not touch, brings the outputs to safety and resets the processor. So a
 * master hears from the amplifier again, and can read what happened. The stack is guarded by the memory protection
 * unit.
 */
#ifndef STARTUP_H
#define STARTUP_H

#include <stdbool.h>
#include <stdint.h>

/** Interrupt handlers, by the name of the peripheral. */
void systick_handler(void);
void tim2_handler(void);
void usart1_handler(void);

/** What the last run left behind. Whole, or all zero: after power came on, memory holds anything. */
typedef struct {
    uint32_t starts;        /**< before this one, since power came on */
    bool faulted;           /**< the last run ended in a fault */
    uint32_t fault_address; /**< of the instruction, 0 if the stack does not say */
    uint32_t fault_status;  /**< CFSR of the Armv7-M manual */
} last_run_t;

/** Takes the record and begins a new one. Once, at the start of board_init. `power_came_on`: distrust what is there. */
last_run_t last_run_take(bool power_came_on);

/**
 * Called once, with interrupts off, on any fault, and when main returns. Brings the outputs to where they can stay, by
 * a ramp; when it returns, the processor is reset. Must not rely on anything but registers and plain constants: memory
 * may be damaged. Must be done before the hardware watchdog bites.
 */
void outputs_to_safety(void);

#endif
