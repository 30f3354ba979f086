/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench/firmware_file.h"
#include <stdio.h>
#include <string.h>
#include <unistd.h>

bool firmware_file_find(char *path, size_t size, failure_t *failure) {
    static const char *const places[] = {"bench.elf", "../share/hyst/bench.elf", "../arm/firmware/bench.elf"};
    char program[4096];
    const ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    if (length > 0) {
        program[length] = '\0';
        program[strrchr(program, '/') - program + 1] = '\0';
        for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
            const int written = snprintf(path, size, "%s%s", program, places[i]);
            if (written > 0 && (size_t)written < size && access(path, R_OK) == 0) {
                return true;
            }
        }
    }
    return fail(failure, "no firmware for the emulator comes with this program: build it (./scripts/build; it takes "
                         "arm-none-eabi-gcc), or give one with --image ELF");
}
