/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The options of a command that plays a waveform. */
#ifndef WAVEFORM_OPTIONS_H
#define WAVEFORM_OPTIONS_H

#include "amplifier/waveform.h"
#include "command_line/command_line.h"

/* clang-format off */
/** Lines of an option_t table that fill a waveform_options_t, but for the cycles. `unit`: "V" or "UM". */
#define WAVEFORM_SHAPE_OPTIONS(options, unit)                                                                          \
    {"--waveform", "-w", OPTION_TEXT, WAVEFORM_NAMES, "what to play; a triangle has shrinking minor loops",            \
     &(options).name},                                                                                                 \
    {"--frequency", "-f", OPTION_NUMBER, "HZ", "cycles per second (1); a sweep begins there", &(options).frequency_hz},\
    {"--amplitude", "-a", OPTION_NUMBER, unit, "to each side of the offset (four fifths of the range)",                \
     &(options).amplitude},                                                                                            \
    {"--offset", NULL, OPTION_NUMBER, unit, "middle (that of the range)", &(options).offset},                          \
    {"--steps", NULL, OPTION_COUNT, "N", "steps of a staircase from bottom to top (10)", &(options).steps},            \
    {"--end-frequency", NULL, OPTION_NUMBER, "HZ", "where a sweep ends; highest tone of a multisine (100)",            \
     &(options).end_frequency_hz},                                                                                     \
    {"--sweep-time", NULL, OPTION_NUMBER, "S", "how long a sweep takes (10)", &(options).sweep_s},                     \
    {"--linear", NULL, OPTION_FLAG, NULL, "sweep by equal steps of the frequency, not by equal factors",               \
     &(options).linear},                                                                                               \
    {"--tones", NULL, OPTION_COUNT, "N", "tones of a multisine, odd multiples of its frequency (16)", &(options).tones}

/** The same with the cycles. */
#define WAVEFORM_OPTIONS(options, unit)                                                                                \
    WAVEFORM_SHAPE_OPTIONS(options, unit),                                                                             \
    {"--cycles", "-n", OPTION_COUNT, "N", "cycles to play (3)", &(options).cycles}
/* clang-format on */

/** waveform_make for a command. Returns OPTIONS_RUN, or the usage error's status after printing it. */
int waveform_choose(const command_t *command, const waveform_options_t *options, const double range[2],
                    const char *unit, waveform_t *waveform);

/** The same before the range is known: whatever is wrong with the options alone is said before a port is opened. */
int waveform_check(const command_t *command, const waveform_options_t *options);

#endif
