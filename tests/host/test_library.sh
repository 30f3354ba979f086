#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The library of the host (host_tools/README.md) has no name twice: of two functions with one name in two rooms the
# linker would silently take one for both. And it never prints and never ends the process: NM LIBRARY finds none of the
# functions in it that would. Two exceptions, each in one file: abort when memory runs out and nobody handles it
# (base/failure.h), and _exit in the child process that could not become the emulator (bench/emulator.c).
set -eu
forbidden='printf|vprintf|__printf_chk|__vprintf_chk|puts|putchar|putc_unlocked|perror|psignal|warn|warnx|err|errx|stdout|stderr'
forbidden="$forbidden|exit|_Exit|quick_exit|raise|abort|_exit|isatty"
found=$("$1" --print-file-name --undefined-only "$2" | awk -v names="^($forbidden)\$" '
    {
        split($1, part, ":")
        file = part[2]
        symbol = $NF
        sub(/@.*/, "", symbol)
        allowed = (file ~ /^failure\.c/ && symbol == "abort") || (file ~ /^emulator\.c/ && symbol == "_exit")
        if (symbol ~ names && !allowed) {
            print file ": " symbol
        }
    }')
twice=$("$1" --defined-only --extern-only "$2" | awk 'NF == 3 { print $3 }' | sort | uniq -d)
if [ -n "$twice" ]; then
    echo "Defined in two files of the library:"
    echo "$twice"
    exit 1
fi
if [ -n "$found" ]; then
    echo "The library prints, or ends the process:"
    echo "$found"
    exit 1
fi
"$1" --undefined-only "$2" | grep -q ' abort' || {
    echo "$2: no symbols were read"
    exit 1
}
