/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/waveform_options.h"
#include <math.h>

int waveform_choose(const command_t *command, const waveform_options_t *options, const double range[2],
                    const char *unit, waveform_t *waveform) {
    failure_t failure;
    return waveform_make(options, range, unit, waveform, &failure) ? OPTIONS_RUN
                                                                   : usage_error(command, "%s", failure.text);
}

int waveform_check(const command_t *command, const waveform_options_t *options) {
    const double middle = isnan(options->offset) ? 0.0 : options->offset;
    const double reach = isnan(options->amplitude) ? 1.0 : fabs(options->amplitude);
    waveform_t waveform; /* in a range in which the levels fit */
    return waveform_choose(command, options, (const double[2]){middle - 2.0 * reach, middle + 2.0 * reach}, "",
                           &waveform);
}
