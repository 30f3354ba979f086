/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The amplifier at the other end of a serial line: Modbus RTU client. opening.h opens it, arming.h makes it ready to
 * move, restart.h notices when it has started anew.
 *
 * Registers are named by their index in the table that the firmware is made from (register_table.h): the register
 * `mode` is INDEX_mode. A value is the register's integer: an unsigned count, an enumeration or a signed fraction
 * (Q31). The caller converts units (compile.h).
 *
 * Requests that get no answer or a damaged one are repeated (serial_line.h). All other errors fail at once with one
 * line.
 */
#ifndef DEVICE_H
#define DEVICE_H

#include "amplifier/device/device_type.h"
#include "amplifier/line/line_options.h"
#include "registers/control.h"
#include "registers/register_table.h"
#include <signal.h>
#include <stdint.h>

/** Whether it has the version that is known here. */
bool device_map_known(const device_t *device);
/** Fails where it has not, with the side to upgrade. */
bool device_expect_known_map(const device_t *device, failure_t *failure);
/** From now on, once *stop is the number of a signal, every request fails at once with "interrupted (SIGINT)"; a
 * request in progress is completed first. NULL ends this. */
void device_stop_when(device_t *device, const volatile sig_atomic_t *stop);

/** For a program that must get a word in while an experiment has the line. turn NULL ends this. To end the experiment a
 * turn fails again and again: some requests may fail without that. */
void device_take_turns(device_t *device, device_turn_t *turn, void *context);

/** From begin to end neither a stop nor a turn keeps a request back: for what leaves the amplifier safe. They nest. */
void device_clean_up_begin(device_t *device);
void device_clean_up_end(device_t *device);

/** Value of an identity register (`magic` to `serial_low`), as read when the device was opened. */
int64_t device_identity(const device_t *device, int which);
/** The serial number in hexadecimal, or "" where there is none. */
#define DEVICE_SERIAL_TEXT 25
void device_serial(const device_t *device, char text[DEVICE_SERIAL_TEXT]);
/** Board, serial number and firmware: "board h405, serial number 0044.., firmware 1.2.0". */
#define DEVICE_TEXT 100
void device_text(const device_t *device, char text[DEVICE_TEXT]);
/** Samples per second of the loop. */
double device_sample_rate_hz(const device_t *device);

/** The present value; of a telemetry register that of a new snapshot. */
bool device_read(device_t *device, int which, int64_t *value, failure_t *failure);

/**
 * Reads the registers first..last, which must have neighbouring addresses, in one request, so that they belong
 * together. value has REGISTER_COUNT elements; those of first..last are written. Telemetry registers show the snapshot
 * that was taken when `sequence` was last read.
 */
bool device_read_span(device_t *device, int first, int last, int64_t *value, failure_t *failure);

/** One telemetry snapshot: the registers `sequence` to `reference_limited` of one sample. */
bool device_read_telemetry(device_t *device, int64_t value[REGISTER_COUNT], failure_t *failure);

/** What fits into the register, whatever the amplifier takes of it. */
void device_register_range(int which, int64_t *low, int64_t *high);

/** Refuses a value that does not fit into the register. */
bool device_write(device_t *device, int which, int64_t value, failure_t *failure);

/** Writes the registers first..last, as device_read_span reads them, in one request: all or none of them, and the
 * amplifier checks them together. */
bool device_write_span(device_t *device, int first, int last, const int64_t *value, failure_t *failure);

/**
 * Registers that can be read while a sample passes. Never more than a good line carries at its baud rate, where full
 * requests occupy 40 % of it: the rest is for turnaround, for a USB adapter with 16 ms of latency, and for other
 * requests. Less where a few such requests, made here, show a slower line: 70 % of what these carried.
 */
bool device_registers_per_sample(device_t *device, double *registers, failure_t *failure);

/** Makes these writable (CONTROL_PARAMETERS, CONTROL_OUTPUT; register `unlock`): for what the user's command means to
 * change. */
bool device_unlock(device_t *device, unsigned what, failure_t *failure);

/** Locks it again, if device_unlock was called; device_close does, too. As far as it can be done: a line that is gone
 * has no locks. Where another master was driving with its keys when the parameters alone were unlocked here, they are
 * left to it, those of the parameters, too. */
void device_lock(device_t *device);

/** Leaves the locks as they are: the amplifier no longer answers at these settings. */
void device_forget_locks(device_t *device);

/** A command, repeated when its answer is lost. Not for `start`, which would restart the source, nor for the save. */
bool device_command(device_t *device, control_command_t command, failure_t *failure);

/** Called when COMMAND_STOP, which is the only way out, has led the amplifier out of a fault, also as a part of
 * device_arm: what had tripped, of the bits of faults_sticky. */
typedef void device_left_fault_t(void *context, int64_t tripped);
/** From now on; say NULL ends it. */
void device_when_left_fault(device_t *device, device_left_fault_t *say, void *context);

/** COMMAND_SAVE, each of which erases a sector of the flash and takes up to 1 s: not repeated if only its answer was
 * lost. Whether the flash took it is in register `store_state`. *refused: the amplifier did not take the command, as
 * where its output is not yet at rest. */
bool device_save(device_t *device, bool *refused, failure_t *failure);

/** Starts the source. After a lost answer it checks whether the armed capture has begun, and does not start again. */
bool device_start(device_t *device, failure_t *failure);

/** `count` registers of the block at the address `block` (ADDRESS_capture ...), from its register `offset` on, in as
 * many requests as needed. */
bool device_read_block(device_t *device, int block, size_t offset, size_t count, uint16_t *value, failure_t *failure);
bool device_write_block(device_t *device, int block, size_t offset, size_t count, const uint16_t *value,
                        failure_t *failure);

/** The block `stream` from this frame on, at most 125 registers of it, in one request (stream_reader.h). */
bool device_read_stream(device_t *device, uint32_t from, size_t count, uint16_t *value, failure_t *failure);

/** Value of register `watchdog` while the actuator is driven: 1 s, or slightly more than the longest time between two
 * received requests on a barely usable line (lost attempts and the silences around them). */
int64_t device_communication_timeout_ms(const device_t *device);

/** Requests that had to be repeated since the device was opened. */
unsigned long device_repetitions(const device_t *device);

#endif
