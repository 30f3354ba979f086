/* SPDX-License-Identifier: MIT */
/** Arm semihosting (Arm's specification 2.0): an emulator or a debugger does the input and output. On silicon without a
 * debugger the first call is a fault. Any context; the processor stands still until the call returns. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

enum {
    SYS_OPEN = 0x01,
    SYS_WRITE0 = 0x04,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT = 0x18,
};

/** Modes of SYS_OPEN: as fopen's "rb" and "wb". */
enum { SEMIHOSTING_READ = 1, SEMIHOSTING_WRITE = 5 };

/** `argument`: a number, or the address of a block of words, as the operation has it. */
static inline intptr_t semihosting(uint32_t operation, uintptr_t argument) {
    register uintptr_t r0 __asm__("r0") = operation;
    register uintptr_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return (intptr_t)r0;
}

#endif
