# SPDX-License-Identifier: MIT
board(NAME bench ID 2 TEXT "bench (emulated)" CHIP stm32f405 SOURCES board.c)
