/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench/twin.h"
#include "base/monotonic_clock.h"
#include "chain/catalogue.h"
#include "chain/chain.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CODES       65536.0
#define CODE_MIDDLE 32768.0

/* As much as a board takes for a supply (firmware/boards/bench). */
#define SUPPLY_MOST_MV 1048575.0
/* A delay longer than this is not made up for by faster samples. */
#define PACE_LATE_S 0.1

/* Linear scale of a converter. */
typedef struct {
    double center, half_range;
} scale_t;

typedef struct {
    double *drive_v, *position_um;
    size_t samples, capacity;
} log_t;

struct twin {
    chain_t *chain;
    chain_t *loaded; /* NULL: no load comes. It follows from the beginning, so that its memory is the same */
    twin_options_t options;
    unsigned long samples;
    scale_t drive, position;
    double position_um;
    log_t log;
};

static scale_t scale_of(const double range[2]) {
    return (scale_t){(range[0] + range[1]) / 2.0, (range[1] - range[0]) / 2.0};
}

/* Inserts a block after all blocks of the same or an earlier place. */
static model_block_t *insert_block(model_t *model, const char *name) {
    const block_t *block = catalogue_find(name);
    (void)model_append(model, block);
    size_t at = model->blocks - 1;
    while (at > 0 && model->block[at - 1].block->place > block->place) {
        const model_block_t later = model->block[at - 1];
        model->block[at - 1] = model->block[at];
        model->block[at] = later;
        at--;
    }
    return &model->block[at];
}

static bool extend_model(model_t *model, const twin_options_t *options, bool loaded, failure_t *failure) {
    const double mode_hz = loaded ? options->load_hz : options->resonance_hz;

    if (model->blocks + 2 > MODEL_MAX_BLOCKS) {
        return fail(failure, "the model has no room for further blocks: it has %zu", model->blocks);
    }
    if (mode_hz > 0.0) {
        model_block_t *resonance = insert_block(model, "resonance");
        model_set(resonance, "frequency_hz", mode_hz);
        model_set(resonance, "damping_ratio", loaded ? options->load_damping : options->resonance_damping);
    }
    if (options->noise_um > 0.0) {
        model_set(insert_block(model, "sensor_noise"), "rms_um", options->noise_um);
    }
    return model_check(model, "twin", failure);
}

static chain_t *open_chain(const model_t *model, const twin_options_t *options, bool loaded, failure_t *failure) {
    model_t extended;
    model_copy(&extended, model);
    chain_t *chain = NULL;
    if (extend_model(&extended, options, loaded, failure)) {
        chain = chain_open(&extended, options->sample_rate_hz * (double)options->substeps, options->seed, failure);
    }
    model_free(&extended);
    return chain;
}

twin_t *twin_open(const model_t *model, const twin_options_t *options, failure_t *failure) {
    chain_t *chain = open_chain(model, options, false, failure);
    chain_t *loaded = chain != NULL && options->load_hz > 0.0 ? open_chain(model, options, true, failure) : NULL;
    if (chain == NULL || (options->load_hz > 0.0 && loaded == NULL)) {
        chain_close(chain);
        return NULL;
    }
    twin_t *twin = allocate(1, sizeof *twin);
    *twin = (twin_t){.chain = chain,
                     .loaded = loaded,
                     .options = *options,
                     .drive = scale_of(options->drive_range_v),
                     .position = scale_of(options->position_range_um)};
    const double rest_v = fmin(fmax(0.0, options->drive_range_v[0]), options->drive_range_v[1]);
    twin->position_um = chain_settle(chain, rest_v);
    if (loaded != NULL) {
        (void)chain_settle(loaded, rest_v);
    }
    return twin;
}

uint16_t twin_position_code(const twin_t *twin) {
    const double fraction = (twin->position_um - twin->position.center) / twin->position.half_range;
    return (uint16_t)fmin(fmax(round(fraction * CODE_MIDDLE + CODE_MIDDLE), 0.0), CODES - 1.0);
}

static double now_s(const twin_t *twin) {
    return (double)twin->samples / twin->options.sample_rate_hz;
}

static bool sags(const twin_t *twin) {
    return twin->options.sags && now_s(twin) >= twin->options.sag_at_s;
}

uint32_t twin_supply_mv(const twin_t *twin) {
    const double whole_v = twin->options.drive_range_v[1], supply_v = sags(twin) ? twin->options.sag_v : whole_v;
    return whole_v > 0.0 ? (uint32_t)fmin(fmax(round(1e3 * supply_v), 1.0), SUPPLY_MOST_MV) : 0;
}

static void log_append(log_t *log, double drive_v, double position_um) {
    if (log->samples == log->capacity) {
        log->capacity = log->capacity == 0 ? 65536 : 2 * log->capacity;
        log->drive_v = reallocate(log->drive_v, log->capacity, sizeof *log->drive_v);
        log->position_um = reallocate(log->position_um, log->capacity, sizeof *log->position_um);
    }
    log->drive_v[log->samples] = drive_v;
    log->position_um[log->samples] = position_um;
    log->samples++;
}

void twin_step(twin_t *twin, uint16_t drive_code) {
    const twin_options_t *options = &twin->options;
    const bool loaded = twin->loaded != NULL && now_s(twin) >= options->load_at_s;
    const double asked_v =
        twin->drive.center + twin->drive.half_range * ((double)drive_code - CODE_MIDDLE) / CODE_MIDDLE;
    const double drive_v = sags(twin) ? fmin(asked_v, options->sag_v) : asked_v;
    for (unsigned long i = 0; i < options->substeps; i++) {
        const double free_um = chain_step(twin->chain, drive_v);
        const double loaded_um = twin->loaded != NULL ? chain_step(twin->loaded, drive_v) : free_um;
        twin->position_um = loaded ? loaded_um : free_um;
    }
    twin->samples++;
    if (twin->options.log != NULL) {
        log_append(&twin->log, drive_v, twin->position_um);
    }
}

void twin_close(twin_t *twin) {
    if (twin == NULL) {
        return;
    }
    chain_close(twin->chain);
    chain_close(twin->loaded);
    free(twin->log.drive_v);
    free(twin->log.position_um);
    free(twin);
}

static bool log_write(const twin_t *twin, failure_t *failure) {
    const log_t *log = &twin->log;
    if (log->samples < 2) {
        return fail(failure, "%s: not written: %zu samples are no recording", twin->options.log, log->samples);
    }
    recording_t recording;
    recording_create(&recording, twin->options.log, twin->options.sample_rate_hz, log->samples);
    recording_set_key(&recording, "source", "hyst twin: simulated voltage and position, before the converters");
    memcpy(recording.column[COLUMN_DRIVE], log->drive_v, log->samples * sizeof *log->drive_v);
    memcpy(recording.column[COLUMN_DISPLACEMENT], log->position_um, log->samples * sizeof *log->position_um);
    const bool written = recording_write(&recording, twin->options.log, failure);
    recording_free(&recording);
    return written;
}

/* Whether the next sample is due by now, which counts from *start_s, so that errors do not add up. */
static bool is_due(double *start_s, double due_s) {
    const double early_s = *start_s + due_s - monotonic_s();
    if (early_s < -PACE_LATE_S) {
        *start_s -= early_s;
    }
    return early_s <= 0.0;
}

/* A twin of another rate would be another actuator. An older bench does not say its rate. */
static bool has_rate_of(const twin_t *twin, const converter_line_t *line, failure_t *failure) {
    const double rate_hz = twin->options.sample_rate_hz;
    return line->rate_hz == 0 || (double)line->rate_hz == rate_hz ||
           fail(failure,
                "the loop of the firmware has %u Hz, its twin %g Hz: --sample-rate %u gives the twin that rate",
                line->rate_hz, rate_hz, line->rate_hz);
}

static converter_status_t serve(twin_t *twin, converter_line_t *line, void (*ready)(void *context), void *context,
                                twin_run_t *run, double *begin_s, failure_t *failure) {
    double pace_start_s = 0.0;
    for (;;) {
        bool driven = false;
        uint16_t drive_code = 0;
        converter_status_t status = converter_wait(line, &driven, &drive_code, failure);
        if (status != CONVERTER_DONE) {
            return status;
        }
        if (run->samples == 0 && !has_rate_of(twin, line, failure)) {
            return CONVERTER_FAILED;
        }
        if (driven) {
            if (run->samples == 0) {
                *begin_s = pace_start_s = monotonic_s();
                if (ready != NULL) {
                    ready(context);
                }
            }
            twin_step(twin, drive_code);
            run->samples++;
        }
        const bool waits = twin->options.real_time && run->samples > 0 &&
                           !is_due(&pace_start_s, (double)run->samples / twin->options.sample_rate_hz);
        status = waits ? converter_not_yet(line, failure)
                       : converter_answer(line, twin_position_code(twin), twin_supply_mv(twin), failure);
        if (status != CONVERTER_DONE) {
            return status;
        }
    }
}

bool twin_run(twin_t *twin, converter_line_t *line, void (*ready)(void *context), void *context, twin_run_t *run,
              failure_t *failure) {
    *run = (twin_run_t){0};
    double begin_s = 0.0;
    const converter_status_t status = serve(twin, line, ready, context, run, &begin_s, failure);
    run->seconds = run->samples > 0 ? monotonic_s() - begin_s : 0.0;
    failure_t log_failure;
    const bool logged = twin->options.log == NULL || log_write(twin, &log_failure);
    if (status == CONVERTER_FAILED) {
        return false;
    }
    if (!logged) {
        *failure = log_failure;
    }
    return logged;
}
