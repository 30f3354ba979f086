/* SPDX-License-Identifier: MIT */
/**
 * From reset to main(), and what happens when the processor meets a fault. Used by every image for this chip.
 *
 * An image defines the interrupt handlers it uses under the names below; every other interrupt is a fault.
 */
#ifndef STARTUP_H
#define STARTUP_H

/** Interrupt handlers, by the name of the peripheral. */
void systick_handler(void);
void tim2_handler(void);
void usart1_handler(void);
void usart2_handler(void);

/**
 * Called once, with interrupts off, on any fault: hard, memory, bus and usage faults, NMI (the clock security system)
 * and unexpected interrupts. Brings the outputs to where they can stay; when it returns, the processor stops for ever.
 * Must not rely on anything but registers and plain constants: memory may be damaged.
 */
void outputs_to_safety(void);

#endif
