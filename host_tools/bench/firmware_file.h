/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The firmware of the board `bench` that comes with this program. */
#ifndef FIRMWARE_FILE_H
#define FIRMWARE_FILE_H

#include "base/failure.h"
#include <stddef.h>

/** Rate of its loop: the first of RATES in firmware/boards/bench/board.cmake. */
#define FIRMWARE_RATE_HZ 10000.0

/**
 * Finds bench.elf from where the program lies: beside it (the Python package), in ../share/hyst (installed) or in
 * ../arm/firmware (the folder of the build). A program that was built without a compiler for ARM has none.
 */
bool firmware_file_find(char *path, size_t size, failure_t *failure);

#endif
