/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "commands/command.h"
#include "compile/compile.h"
#include "compile/compile_json.h"
#include "compile/hysteresis_text.h"
#include "hyst/cost.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int compile(int argc, char **argv);

const command_t command_compile = {
    .name = "compile",
    .order = 40,
    .arguments = "MODEL [-o IMAGE] [options]",
    .summary = "Turn a model into a validated parameter image for the amplifier",
    .details =
        "The ranges are those of the converters: what code 0 and the top code stand for. Recordings by `hyst "
        "record` state them.\n"
        "For others the default is the range that the recordings cover, widened by 5 %. The drive itself stays "
        "inside the\n"
        "recorded range.\n"
        "A lag or a mode is inverted up to a roll-off. What that leaves at low frequencies is a delay, and the "
        "amplifier looks\n"
        "ahead by that many samples. Each note says how a block is compensated. What cannot be compensated "
        "(rails, a slew limit,\n"
        "drifts, hum) is left out, and a line `not corrected` says which and why. Blocks ellipse and "
        "modified_play belong to one\n"
        "frequency: the amplifier's source has to play a sine of it.\n"
        "What a sample costs at worst is counted under emulation (docs/TIMING.md); an amplifier whose loop has no "
        "time for it\n"
        "refuses the image, and a note says so for the processor of the boards that there are.",
    .run = compile,
    .files = FILE_MODEL FILE_IMAGE,
    .examples =
        "# An image for a loop at 10 kHz, with the ranges that the ends of the converters stand for\n"
        "hyst compile model.json --sample-rate 10000 --drive-range 0:120 --position-range -2:40 -o model.image\n"
        "# Correct a delay of 20 us that `hyst track` has measured\n"
        "hyst compile model.json --sample-rate 10000 --delay 20e-6 -o model.image\n"};

/* A microvolt is the finest that the image's scales say; what is below is rounding of Q31. */
static double shown_volts(const hyst_parameters_t *p, hyst_q31_t drive) {
    return 1e-6 * round(1e6 * drive_to_volts(p, drive)) + 0.0; /* + 0.0: no negative zero */
}

/* What is smaller is the rounding of a sum, and differs between machines. */
static const double finest_um = 1e-9;

static void print_text(const hyst_parameters_t *p, const compile_report_t *report) {
    printf("model id           %08x\n", (unsigned)p->model_id);
    printf("sample rate        %.6g Hz\n", 1e-3 * p->sample_rate_mhz);
    printf("drive converter    %.6g to %.6g V, limited to %.6g to %.6g V, parked at %.6g V\n",
           shown_volts(p, HYST_Q31_MIN), shown_volts(p, HYST_Q31_MAX), shown_volts(p, p->drive_low),
           shown_volts(p, p->drive_high), shown_volts(p, p->drive_park));
    printf("position converter %.6g to %.6g um\n", position_to_micrometres(p, HYST_Q31_MIN),
           position_to_micrometres(p, HYST_Q31_MAX));
    printf("hysteresis         %s: %u %s", hysteresis_name(p), (unsigned)hysteresis_size(p), hysteresis_parts(p));
    if (report->model_operators > 0) {
        printf(", from %zu of the model", report->model_operators);
    }
    printf(" (a branch changes by at most %.3g um)\n",
           report->merge_error_um < finest_um ? 0.0 : report->merge_error_um);
    if (p->pi_beta > 0) {
        printf("rate dependence    beta %.6g samples, rate gain %.6g, thresholds grow by at most %.6g V\n",
               p->pi_beta * 0x1p-20, p->pi_rate_gain * 0x1p-30, report->growth_limit_v);
    }
    printf("lookahead          %u samples, %.4g us of delay remain\n", (unsigned)p->lookahead_samples,
           1e6 * report->lookahead_remainder_s);
    printf("filter sections    %u before the inverse hysteresis, %u beside it, %u behind it; %u creep cells%s%s\n",
           (unsigned)p->shape_sections, (unsigned)p->inertia_sections, (unsigned)p->equalise_sections,
           (unsigned)p->creep_cells, p->drive_curves > 0 ? "; a drive curve" : "",
           p->reference_curves > 0 ? "; a reference curve" : "");
    printf("cost at worst      %u instructions a sample; at %u cycles each (assumed) %u of %u at %g MHz\n",
           (unsigned)hyst_cost_instructions(p), HYST_COST_CYCLES_PER_INSTRUCTION, (unsigned)hyst_cost_cycles(p),
           (unsigned)hyst_cost_budget(HYST_COST_CORE_HZ, p->sample_rate_mhz), 1e-6 * HYST_COST_CORE_HZ);
    for (size_t i = 0; i < report->notes; i++) {
        printf("note: %s\n", report->note[i]);
    }
    for (size_t i = 0; i < report->uncorrected; i++) {
        printf("not corrected: %s: %s\n", report->uncorrected_block[i].block, report->uncorrected_block[i].why);
    }
}

static int compile(int argc, char **argv) {
    compile_options_t settings = {0};
    const char *output = NULL;
    const char *follow = "reading";
    bool as_json = false, good;
    const option_t options[] = {
        {"--output", "-o", OPTION_OUTPUT, "IMAGE", "write the image (32-bit words, least significant byte first)",
         &output},
        {"--sample-rate", NULL, OPTION_NONZERO, "HZ", "rate of the amplifier's loop (default: the model's)",
         &settings.sample_rate_hz},
        {"--drive-range", NULL, OPTION_RANGE, "LO:HI", "range of the drive converter in V", settings.drive_range_v},
        {"--position-range", NULL, OPTION_RANGE, "LO:HI", "range of the position converter in um",
         settings.position_range_um},
        {"--delay", NULL, OPTION_NUMBER, "S",
         "delay beyond the model's, as `hyst track` measures it; negative: the position is early", &settings.delay_s},
        {"--frequency", NULL, OPTION_NONZERO, "HZ", "frequency of the sine at which block ellipse is inverted",
         &settings.frequency_hz},
        {"--preload", NULL, OPTION_NUMBER, "N", "force on the actuator, for a model with preload (default 0)",
         &settings.preload_n},
        {"--follow", NULL, OPTION_TEXT, "reading|position",
         "what follows the reference behind a curved sensor: its reading (default), or the position", &follow},
        {"--no-filters", NULL, OPTION_FLAG, NULL, "do not invert lags and modes, only look ahead over their delay",
         &settings.no_filters},
        JSON_OPTION(&as_json)};
    hyst_parameters_t parameters;
    compile_report_t report;
    model_t model;
    size_t positionals;
    failure_t failure;
    const int status =
        options_parse(&command_compile, options, sizeof options / sizeof options[0], argc, argv, 1, 1, &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (settings.sample_rate_hz < 0.0) {
        return usage_error(&command_compile, "--sample-rate must be positive");
    }
    if (settings.frequency_hz < 0.0) {
        return usage_error(&command_compile, "--frequency must be positive");
    }
    if (settings.preload_n < 0.0) {
        return usage_error(&command_compile, "--preload must not be negative");
    }
    settings.follow_position = strcmp(follow, "position") == 0;
    if (!settings.follow_position && strcmp(follow, "reading") != 0) {
        return usage_error(&command_compile, "--follow %s: not reading or position", follow);
    }
    if (!model_read(&model, argv[1], &failure)) {
        return failure_print(&failure);
    }
    good = compile_model(&model, &settings, &parameters, &report, &failure) || fail_in(&failure, "%s", argv[1]);
    model_free(&model);
    good = good && (output == NULL || image_write(&parameters, output, &failure));
    good = good && (!as_json || json_print(compile_to_json(&parameters, &report), JSON_INDENT(2), &failure));
    if (good && text_wanted(as_json)) {
        print_text(&parameters, &report);
    }
    return good ? STATUS_DONE : failure_print(&failure);
}
