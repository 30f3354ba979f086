/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What `hyst twin` and `hyst bench` ask about the twin. */
#ifndef TWIN_OPTIONS_H
#define TWIN_OPTIONS_H

#include "command.h"
#include "twin.h"

typedef struct {
    twin_options_t twin;
    const char *resonance; /**< "HZ:ZETA" or NULL */
    const char *speed;     /**< "realtime" or "fast" */
} twin_settings_t;

#define TWIN_SETTINGS_DEFAULT                                                                                          \
    { .twin = {.sample_rate_hz = 10000.0, .substeps = 8, .seed = 1}, .resonance = NULL, .speed = "realtime" }

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
        {"--speed",                                                                                                    \
         NULL,                                                                                                         \
         OPTION_TEXT,                                                                                                  \
         "realtime|fast",                                                                                              \
         "paced by the clock, or as fast as answers come (realtime)",                                                  \
         &(settings).speed},                                                                                           \
    {                                                                                                                  \
        "--log", NULL, OPTION_TEXT, "CSV", "recording of voltage and position before the converters, kept in memory",  \
            &(settings).twin.log                                                                                       \
    }

/** Checks the values and fills the rest of settings->twin. OPTIONS_RUN, or the usage error's status after printing it.
 */
int twin_options_check(const command_t *command, twin_settings_t *settings);

/** Reads the model and opens the twin; ranges that were not given come from the model. NULL on failure. */
twin_t *twin_from_file(const char *model_path, const twin_settings_t *settings, failure_t *failure);

/** One line about a run. */
void twin_print_run(const twin_run_t *run, const twin_settings_t *settings);

#endif
