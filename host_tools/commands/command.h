/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Subcommands of `hyst`. To add one, add one file command_NAME.c that defines `const command_t command_NAME = {`: the
 * build finds it, and the test host_contract reports what is missing. Its manual page and its completion are generated
 * from that and from its option table (manual.c).
 */
#ifndef COMMAND_H
#define COMMAND_H

#include "command_line/command_line.h"
#include "command_line/print.h"
#include "command_list.h" /* generated: every command_t of command_*.c, by its .order */

#define COMMAND_DECLARE(name) extern const command_t command_##name;
COMMAND_LIST(COMMAND_DECLARE)
#undef COMMAND_DECLARE

extern const command_t *const commands[];
extern const size_t commands_count;

/* What `hyst --help` and the manual page of the whole both say. */
#define HYST_PURPOSE                                                                                                   \
    "Identifies a piezo actuator from recordings, and makes the amplifier compensate its hysteresis and dynamics."
/* Variables, a line each: "NAME: what it does". */
#define HYST_ENVIRONMENT                                                                                               \
    "NO_COLOR: changes nothing: no output is coloured, with it or without. On a terminal, stderr has a line of "       \
    "progress that is erased in the end.\n"                                                                            \
    "HYST_PROGRESS: with the value `lines`, progress is lines on stderr, for programs.\n"                              \
    "HYST_THREADS: so many threads at most compute, in place of as many as processors. Results are the same.\n"        \
    "SOURCE_DATE_EPOCH: seconds since 1970: the date that pages and HDF5 files say in place of now.\n"
#define HYST_EXIT_STATUS                                                                                               \
    "0 done, 1 the input or the device is at fault (one line on stderr says what and where), 2 wrong usage."

/* Files of more than one command, for the FILES section of their manual pages. */
#define FILE_RECORDING                                                                                                 \
    "RECORDING: CSV with header lines `# key: value` and columns t (s), drive (V) and displacement (um); optional "    \
    "columns are reference, voltage, current and temperature. Sampled uniformly. A name that ends in .h5 is HDF5.\n"
#define FILE_MODEL "MODEL.json: a chain of blocks with their parameters, JSON, format hyst-model-1.\n"
#define FILE_IMAGE "IMAGE: parameter image, version 3: 32-bit words, least significant byte first, with a CRC-32.\n"

#endif
