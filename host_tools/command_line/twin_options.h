/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The options of `hyst twin` and `hyst bench` for the twin. */
#ifndef TWIN_OPTIONS_H
#define TWIN_OPTIONS_H

#include "bench/twin.h"
#include "command_line/command_line.h"
#include <math.h>

typedef struct {
    twin_options_t twin;
    const char *resonance;             /**< "HZ:ZETA" or NULL */
    const char *load;                  /**< the same */
    double load_at_s, sag_v, sag_at_s; /**< NAN: not given */
    const char *speed;                 /**< "realtime" or "fast" */
} twin_settings_t;

#define TWIN_SETTINGS_DEFAULT                                                                                          \
    {                                                                                                                  \
        .twin = {.sample_rate_hz = 10000.0, .substeps = 8, .seed = 1}, .resonance = NULL, .load = NULL,                \
        .load_at_s = (double)NAN, .sag_v = (double)NAN, .sag_at_s = (double)NAN, .speed = "realtime"                   \
    }

/** Lines of an option_t table that fill a twin_settings_t. */
#define TWIN_OPTIONS(settings)                                                                                         \
    {"--drive-range",                                                                                                  \
     NULL,                                                                                                             \
     OPTION_RANGE,                                                                                                     \
     "LO:HI",                                                                                                          \
     "range of the drive converter in V (as `hyst compile`)",                                                          \
     (settings).twin.drive_range_v},                                                                                   \
        {"--position-range",                                                                                           \
         NULL,                                                                                                         \
         OPTION_RANGE,                                                                                                 \
         "LO:HI",                                                                                                      \
         "range of the position converter in um (as `hyst compile`)",                                                  \
         (settings).twin.position_range_um},                                                                           \
        {"--sample-rate",                                                                                              \
         NULL,                                                                                                         \
         OPTION_NUMBER,                                                                                                \
         "HZ",                                                                                                         \
         "samples per second of the converters (10000)",                                                               \
         &(settings).twin.sample_rate_hz},                                                                             \
        {"--substeps", NULL, OPTION_COUNT, "N", "steps of the model per sample (8)", &(settings).twin.substeps},       \
        {"--noise-um", NULL, OPTION_NUMBER, "UM", "sensor noise, RMS (none)", &(settings).twin.noise_um},              \
        {"--seed", NULL, OPTION_COUNT, "N", "of the noise (1)", &(settings).twin.seed},                                \
        {"--resonance",                                                                                                \
         NULL,                                                                                                         \
         OPTION_TEXT,                                                                                                  \
         "HZ:ZETA",                                                                                                    \
         "a mode of the mechanics: frequency and damping ratio (none)",                                                \
         &(settings).resonance},                                                                                       \
        {"--load",                                                                                                     \
         NULL,                                                                                                         \
         OPTION_TEXT,                                                                                                  \
         "HZ:ZETA",                                                                                                    \
         "a load comes: the mode from --load-at on, in place of --resonance",                                          \
         &(settings).load},                                                                                            \
        {"--load-at", NULL, OPTION_NUMBER, "S", "when, in the twin's time", &(settings).load_at_s},                    \
        {"--sag", NULL, OPTION_NUMBER, "V", "the supply sags: no higher voltage from --sag-at on", &(settings).sag_v}, \
        {"--sag-at", NULL, OPTION_NUMBER, "S", "when, in the twin's time", &(settings).sag_at_s},                      \
        {"--speed",                                                                                                    \
         NULL,                                                                                                         \
         OPTION_TEXT,                                                                                                  \
         "realtime|fast",                                                                                              \
         "paced by the clock, or as fast as answers come (realtime)",                                                  \
         &(settings).speed},                                                                                           \
    {                                                                                                                  \
        "--log", NULL, OPTION_OUTPUT, "CSV",                                                                           \
            "recording of voltage and position before the converters, kept in memory", &(settings).twin.log            \
    }

/** Checks the values and fills the rest of settings->twin. OPTIONS_RUN, or the usage error's status after printing it.
 */
int twin_options_check(const command_t *command, twin_settings_t *settings);

/** Whether the twin has the rate of the loop that the emulator is to run: image NULL: the firmware that comes with this
 * program. As twin_options_check. */
int twin_rate_check(const command_t *command, const twin_settings_t *settings, const char *image);

/** One line about a run, on stderr. */
void twin_print_run(const twin_run_t *run, const twin_settings_t *settings);

#endif
