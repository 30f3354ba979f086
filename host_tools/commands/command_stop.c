/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/driving.h"
#include "commands/command.h"
#include "commands/halt_command.h"

static int run(int argc, char **argv) {
    static const halt_command_t halt = {.halt = COMMAND_STOP, .format = "hyst-stop-1", .sentence = "nothing plays now"};
    return halt_command_run(&command_stop, &halt, argc, argv);
}

const command_t command_stop = {.name = "stop",
                                .order = 113,
                                .arguments = "--port DEV",
                                .summary = "Stop what the amplifier plays; it holds where it is",
                                .details = "Ends a waveform, a probe or the sweep of the drive range. The drive stays "
                                           "on, and holds its last level, until the\n"
                                           "communication timeout that was set (`hyst play --silence`) parks it; `hyst "
                                           "park` takes it to rest at once. Out of a\n"
                                           "fault it leads to off. A port that another hyst has open is not free: end "
                                           "that one, as `record` and `track` park "
                                           "the\n"
                                           "amplifier themselves when they are ended.",
                                .run = run,
                                .examples = "# End a waveform that plays, and hold the drive; then take it to rest\n"
                                            "hyst stop --port /dev/ttyUSB0\n"
                                            "hyst park --port /dev/ttyUSB0\n"};
