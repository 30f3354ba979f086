/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/driving.h"
#include "commands/command.h"
#include "commands/halt_command.h"

static int run(int argc, char **argv) {
    static const halt_command_t halt = {.halt = COMMAND_PARK, .format = "hyst-park-1", .sentence = "stopped"};
    return halt_command_run(&command_park, &halt, argc, argv);
}

const command_t command_park = {
    .name = "park",
    .order = 116,
    .arguments = "--port DEV",
    .summary = "Stop what the amplifier plays, and take the drive to rest",
    .details = "The drive goes to the park level of the image in force, as slowly as that says, and\n"
               "stays there until a mode is set. The stage stays on, unless --off is given.\n"
               "A port that another hyst has open is not free: end that one, as `record` and `track`\n"
               "park the amplifier themselves when they are ended.",
    .run = run,
    .examples = "# Take the drive to rest\n"
                "hyst park --port /dev/ttyUSB0\n"
                "# And switch the stage off there\n"
                "hyst park --port /dev/ttyUSB0 --off\n"};
