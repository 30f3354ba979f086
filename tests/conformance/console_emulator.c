/* SPDX-License-Identifier: MIT */
/* The emulator does the output. */
#include "console.h"
#include "semihosting.h"
#include "startup.h"

enum { STOPPED_RUN_TIME_ERROR = 0x20023, STOPPED_APPLICATION_EXIT = 0x20026 };

void console_write(const char *text) {
    (void)semihosting(SYS_WRITE0, (uintptr_t)text);
}

_Noreturn void console_exit(int status) {
    for (;;) {
        (void)semihosting(SYS_EXIT, status == 0 ? STOPPED_APPLICATION_EXIT : STOPPED_RUN_TIME_ERROR);
    }
}

/* A fault fails the test. */
void outputs_to_safety(void) {
    console_write("processor fault\n");
    console_exit(1);
}
