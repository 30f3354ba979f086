/* SPDX-License-Identifier: MIT */
/**
 * Coils and discrete inputs: what a controller that knows nothing but bits needs. Functions 1, 2, 5 and 15.
 *
 * Coil 0 is "armed": on arms, off disarms (commands 9 and 10, under the same conditions). One coil, so that a request
 * with several cannot be half executed.
 *
 * Discrete inputs, of the newest sample: 0 to 15 the bits of `faults_live`, 16 to 31 of `faults_sticky`, 32 to 47 of
 * `limits_live`, 48 to 63 of `limits_sticky`. Then 64 armed, 65 ready, 66 a source plays, 67 conditioning, 68 in a
 * fault.
 *
 * Main loop only.
 */
#ifndef MODBUS_BITS_H
#define MODBUS_BITS_H

#include <stdbool.h>
#include <stdint.h>

#define MODBUS_COILS           1U
#define MODBUS_DISCRETE_INPUTS 69U

bool modbus_coil(void);
/** The command (control.h) that writing the coil is. */
uint16_t modbus_coil_command(bool on);

/** Bits 0 .. MODBUS_DISCRETE_INPUTS - 1 of one sample, least significant first. */
void modbus_discrete_inputs(uint8_t bits[(MODBUS_DISCRETE_INPUTS + 7U) / 8U]);

#endif
