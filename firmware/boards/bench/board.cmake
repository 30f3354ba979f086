# SPDX-License-Identifier: MIT
board(NAME bench ID 2 TEXT "bench (emulated)" CHIP stm32f405 RATES 10000 20000 25000 50000 SOURCES board.c)
