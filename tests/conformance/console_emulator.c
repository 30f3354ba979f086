/* SPDX-License-Identifier: MIT */
/* Arm semihosting: the emulator does the input and output. On silicon without a debugger the first call is a fault. */
#include "console.h"
#include "startup.h"

enum { SYS_WRITE0 = 0x04, SYS_EXIT = 0x18 };
enum { STOPPED_RUN_TIME_ERROR = 0x20023, STOPPED_APPLICATION_EXIT = 0x20026 };

static void semihosting(uint32_t operation, uintptr_t argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register uintptr_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

void console_write(const char *text) {
    semihosting(SYS_WRITE0, (uintptr_t)text);
}

_Noreturn void console_exit(int status) {
    for (;;) {
        semihosting(SYS_EXIT, status == 0 ? STOPPED_APPLICATION_EXIT : STOPPED_RUN_TIME_ERROR);
    }
}

/* A fault fails the test. */
void outputs_to_safety(void) {
    console_write("processor fault\n");
    console_exit(1);
}
