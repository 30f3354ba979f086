/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The options of a command that plays a waveform. */
#ifndef WAVEFORM_OPTIONS_H
#define WAVEFORM_OPTIONS_H

#include "amplifier/waveform.h"
#include "commands/command_line.h"

/** Lines of an option_t table that fill a waveform_options_t. `unit`: "V" or "UM". */
#define WAVEFORM_OPTIONS(options, unit)                                                                                \
    {                                                                                                                  \
        "--waveform",                                                                                                  \
        "-w",                                                                                                          \
        OPTION_TEXT,                                                                                                   \
        "sine|triangle|staircase",                                                                                     \
        "what to play; a triangle has shrinking minor loops",                                                          \
        &(options).name},                                                                                              \
        {"--frequency", "-f", OPTION_NUMBER, "HZ", "cycles per second (1)", &(options).frequency_hz},                  \
        {"--amplitude",       "-a", OPTION_NUMBER, unit, "to each side of the offset (four fifths of the range)",      \
         &(options).amplitude},                                                                                        \
        {"--offset", NULL, OPTION_NUMBER, unit, "middle (that of the range)", &(options).offset},                      \
        {"--cycles", "-n", OPTION_COUNT, "N", "cycles to play (3)", &(options).cycles}, {                              \
        "--steps", NULL, OPTION_COUNT, "N", "steps of a staircase from bottom to top (10)", &(options).steps           \
    }

/** waveform_make for a command. Returns OPTIONS_RUN, or the usage error's status after printing it. */
int waveform_choose(const command_t *command, const waveform_options_t *options, const double range[2],
                    const char *unit, waveform_t *waveform);

/** The same before the range is known: whatever is wrong with the options alone is said before a port is opened. */
int waveform_check(const command_t *command, const waveform_options_t *options);

#endif
