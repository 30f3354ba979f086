/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/chain.h"
#include "base/progress.h"
#include "base/quantity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct chain {
    size_t stages;
    chain_stage_t stage[MODEL_MAX_BLOCKS];
};

/* What the stages before this one make of a drive that is held: those without dynamics nothing, delays hold it later
 * (of steps, which are short, nothing is counted), and behind a lag it moves between samples. */
static void hold_at_stage(const model_t *model, size_t index, stage_setup_t *setup) {
    size_t order[MODEL_MAX_BLOCKS];
    double whole;
    if (!setup->held && setup->steps < 2) {
        return;
    }
    const size_t blocks = chain_order(model, order);
    for (size_t stage = 0; stage < blocks && order[stage] != index; stage++) {
        const model_block_t *before = &model->block[order[stage]];
        setup->held = setup->held && !before->block->smooths;
        setup->steps = before->block->smooths ? 0 : setup->steps;
        if (before->block->lag == LAG_DELAY) {
            setup->held_since =
                held_later(setup->held_since, before->parameter[0].value[0] * setup->sample_rate_hz, &whole);
        }
    }
}

/* As if the recording were the first that happened. */
static chain_stage_t open_stage(const model_t *model, size_t index, const stage_setup_t *setup) {
    const model_block_t *from = &model->block[index];
    stage_setup_t own = *setup;
    hold_at_stage(model, index, &own);
    own.seed += 0x632BE59BD9B4E019U * (uint64_t)(index + 1);
    return (chain_stage_t){.block = from->block,
                           .state = block_open(from->block, from->parameter, &own),
                           .drive = block_is_hysteresis(from->block) && from->block->pass != NULL && !own.held
                                        ? allocate(1, sizeof(drive_window_t))
                                        : NULL};
}

/* What comes of drives before the recording, each held for long, in front of a hysteresis. */
static double *before_hysteresis(const model_t *model, size_t index, const stage_setup_t *setup) {
    double *value = allocate(setup->befores, sizeof *value);
    size_t order[MODEL_MAX_BLOCKS];
    memcpy(value, setup->before_v, setup->befores * sizeof *value);
    const size_t blocks = chain_order(model, order);
    for (size_t i = 0; i < blocks && order[i] != index; i++) {
        if (!model->block[order[i]].block->modifies_hysteresis) {
            chain_stage_t stage = open_stage(model, order[i], setup);
            for (size_t b = 0; b < setup->befores; b++) {
                signal_t signal = {.value = value[b]};
                chain_stage_settle(&stage, &signal);
                value[b] = signal.value;
            }
            chain_stage_close(&stage);
        }
    }
    return value;
}

chain_stage_t chain_stage_open(const model_t *model, size_t index, const stage_setup_t *setup) {
    chain_stage_t stage = open_stage(model, index, setup);
    if (setup->befores > 0 && block_is_hysteresis(stage.block)) {
        stage.befores = setup->befores;
        stage.before_v = before_hysteresis(model, index, setup);
    }
    return stage;
}

void chain_stage_close(chain_stage_t *stage) {
    free(stage->state);
    free(stage->drive);
    free(stage->before_v);
    stage->state = NULL;
    stage->drive = NULL;
    stage->before_v = NULL;
}

static inline void note_drive(bool hysteresis, signal_t *signal) {
    if (hysteresis) {
        signal->drive_v = signal->value;
    }
}

/* Moves a hysteresis from its present drive to another one, in small steps. Returns its output. */
static double lead(const chain_stage_t *hysteresis, double from_v, double to_v) {
    enum { STEPS = 256 };
    signal_t signal = {0};
    for (int i = 1; i <= STEPS; i++) {
        const double way = (double)i / STEPS;
        signal = (signal_t){.value = from_v + way * (to_v - from_v)};
        note_drive(true, &signal);
        hysteresis->block->step(hysteresis->state, &signal);
    }
    return signal.value;
}

/* Settles on the first of the drives before the recording, and is led through the others to the present one. */
static void settle_behind(const chain_stage_t *stage, signal_t *signal) {
    signal_t first = {.value = stage->before_v[0], .drive_v = stage->before_v[0]};
    stage->block->settle(stage->state, &first);
    for (size_t b = 1; b < stage->befores; b++) {
        (void)lead(stage, stage->before_v[b - 1], stage->before_v[b]);
    }
    signal->value = lead(stage, stage->before_v[stage->befores - 1], signal->value);
}

void chain_stage_settle(const chain_stage_t *stage, signal_t *signal) {
    note_drive(block_is_hysteresis(stage->block), signal);
    if (stage->drive != NULL) {
        drive_window_settle(stage->drive, signal->value);
    }
    if (stage->befores > 0) {
        settle_behind(stage, signal);
    } else {
        stage->block->settle(stage->state, signal);
    }
}

/* An earlier stage may have reported a reversal; the farther one of the two is kept. */
static inline void note_turn(drive_window_t *drive, signal_t *signal) {
    double turn_v;
    drive_window_shift(drive, signal);
    if (drive_window_turns(drive, &turn_v) &&
        (!signal->turned || fabs(turn_v - signal->value) > fabs(signal->turn_v - signal->value))) {
        signal->turned = true;
        signal->turn_v = turn_v;
    }
}

static inline void stage_step(const chain_stage_t *stage, bool hysteresis, signal_t *signal) {
    note_drive(hysteresis, signal);
    if (stage->drive != NULL && !signal->turns_noted) {
        note_turn(stage->drive, signal);
    }
    if (signal->turned && stage->block->pass != NULL && signal->slack_v == 0.0) {
        stage->block->pass(stage->state, signal->turn_v);
    }
    stage->block->step(stage->state, signal);
}

void chain_stage_step(const chain_stage_t *stage, signal_t *signal) {
    stage_step(stage, block_is_hysteresis(stage->block), signal);
}

/* As chain_run takes them: what is settled on, and the samples. */
static signal_t *signals_of(const double *value, size_t count) {
    signal_t *signal = allocate(count + 1, sizeof *signal);
    signal[0].value = value[0];
    for (size_t k = 0; k < count; k++) {
        signal[1 + k].value = value[k];
    }
    return signal;
}

/* `there` signals follow. */
static inline void look_ahead(signal_t *signal, const signal_t *following, size_t there) {
    signal->known_ahead = there < SIGNAL_AHEAD ? there : SIGNAL_AHEAD;
    for (size_t i = 0; i < signal->known_ahead; i++) {
        signal->ahead[i] = following[i].value;
    }
}

void chain_note_turns(signal_t *signal, size_t samples) {
    drive_window_t drive;
    drive_window_settle(&drive, signal[0].value);
    for (size_t k = 1; k <= samples; k++) {
        look_ahead(&signal[k], &signal[k + 1], samples - k);
        note_turn(&drive, &signal[k]);
        signal[k].turns_noted = true;
    }
}

void chain_stage_run(const chain_stage_t *stage, signal_t *signal, size_t count, size_t there) {
    const bool hysteresis = block_is_hysteresis(stage->block);
    for (size_t k = 0; k < count; k++) {
        look_ahead(&signal[k], &signal[k + 1], there - k - 1);
        stage_step(stage, hysteresis, &signal[k]);
    }
}

void chain_stage_values(const chain_stage_t *stage, const signal_t *signal, size_t count, double *value) {
    const bool hysteresis = block_is_hysteresis(stage->block);
    for (size_t k = 0; k < count; k++) {
        signal_t now = signal[k];
        look_ahead(&now, &signal[k + 1], count - k - 1);
        stage_step(stage, hysteresis, &now);
        value[k] = now.value;
    }
}

void chain_between_samples(const recording_t *recording, stage_setup_t *setup) {
    setup->held = recording->held;
    setup->held_since = recording->held_since;
    setup->steps = recording->steps;
}

void chain_pass(const model_t *model, size_t index, const recording_t *recording, double *value) {
    stage_setup_t setup = {.sample_rate_hz = recording->sample_rate_hz};
    chain_between_samples(recording, &setup);
    chain_stage_t stage = chain_stage_open(model, index, &setup);
    signal_t *signal = signals_of(value, recording->samples);
    chain_stage_settle(&stage, &signal[0]);
    chain_stage_run(&stage, signal + 1, recording->samples, recording->samples);
    for (size_t k = 0; k < recording->samples; k++) {
        value[k] = signal[1 + k].value;
    }
    chain_stage_close(&stage);
    free(signal);
}

/* Blocks that widen the loops use the drive of the hysteresis, so they run after blocks that change it. */
static size_t order_modifiers(const model_t *model, bool widening, size_t *order) {
    size_t count = 0;
    for (size_t m = 0; m < model->blocks; m++) {
        if (model->block[m].block->modifies_hysteresis && model->block[m].block->widens == widening) {
            order[count++] = m;
        }
    }
    return count;
}

size_t chain_order(const model_t *model, size_t order[MODEL_MAX_BLOCKS]) {
    size_t count = 0;
    for (size_t i = 0; i < model->blocks; i++) {
        const block_t *block = model->block[i].block;
        if (block_is_hysteresis(block)) {
            count += order_modifiers(model, false, order + count);
            count += order_modifiers(model, true, order + count);
        }
        if (!block->modifies_hysteresis) {
            order[count++] = i;
        }
    }
    return count;
}

static bool may_run(const model_t *model, double sample_rate_hz, failure_t *failure) {
    if (!model_check(model, "model", failure)) {
        return false;
    }
    if (!(isfinite(sample_rate_hz) && sample_rate_hz > 0.0)) {
        return fail(failure, "cannot simulate at a sample rate of %g Hz", sample_rate_hz);
    }
    for (size_t i = 0; i < model->blocks; i++) {
        const block_t *block = model->block[i].block;
        if (block->one_sample_rate != NULL && block->one_sample_rate(model->block[i].parameter) &&
            !(fabs(sample_rate_hz / model->sample_rate_hz - 1.0) <= 1e-6)) {
            return fail(failure,
                        "block %s was identified at %g Hz and holds at no other sample rate, %g Hz was requested",
                        block->name, model->sample_rate_hz, sample_rate_hz);
        }
    }
    return true;
}

chain_t *chain_open_preloaded(const model_t *model, double sample_rate_hz, uint64_t seed, double preload_n,
                              failure_t *failure) {
    const stage_setup_t setup = {.sample_rate_hz = sample_rate_hz, .seed = seed, .preload_n = preload_n};
    size_t order[MODEL_MAX_BLOCKS];
    chain_t *chain;
    if (!may_run(model, sample_rate_hz, failure)) {
        return NULL;
    }
    chain = allocate(1, sizeof *chain);
    chain->stages = chain_order(model, order);
    for (size_t i = 0; i < chain->stages; i++) {
        chain->stage[i] = chain_stage_open(model, order[i], &setup);
    }
    return chain;
}

bool chain_setup(const model_t *model, const recording_t *recording, uint64_t seed, stage_setup_t *setup,
                 failure_t *failure) {
    *setup = (stage_setup_t){.sample_rate_hz = recording->sample_rate_hz, .seed = seed, .clock_s = recording->clock_s};
    chain_between_samples(recording, setup);
    return recording_preload(recording, &setup->preload_n, failure) &&
           recording_drive_before(recording, setup->before_v, &setup->befores, failure) &&
           may_run(model, recording->sample_rate_hz, failure);
}

bool chain_run(const model_t *model, const recording_t *recording, uint64_t seed, size_t first, size_t last,
               signal_t *signal, failure_t *failure) {
    stage_setup_t setup;
    size_t order[MODEL_MAX_BLOCKS];
    if (!chain_setup(model, recording, seed, &setup, failure)) {
        return false;
    }
    chain_order(model, order);
    for (size_t i = first; i < last; i++) {
        if (!progress_go_on(failure)) {
            return false;
        }
        chain_stage_t stage = chain_stage_open(model, order[i], &setup);
        chain_stage_settle(&stage, &signal[0]);
        chain_stage_run(&stage, signal + 1, recording->samples, recording->samples);
        chain_stage_close(&stage);
    }
    return true;
}

chain_t *chain_open(const model_t *model, double sample_rate_hz, uint64_t seed, failure_t *failure) {
    return chain_open_preloaded(model, sample_rate_hz, seed, 0.0, failure);
}

double chain_settle(chain_t *chain, double drive_v) {
    signal_t signal = {.value = drive_v};
    for (size_t i = 0; i < chain->stages; i++) {
        chain_stage_settle(&chain->stage[i], &signal);
    }
    return signal.value;
}

double chain_step(chain_t *chain, double drive_v) {
    signal_t signal = {.value = drive_v};
    for (size_t i = 0; i < chain->stages; i++) {
        chain_stage_step(&chain->stage[i], &signal);
    }
    return signal.value;
}

void chain_close(chain_t *chain) {
    if (chain != NULL) {
        for (size_t i = 0; i < chain->stages; i++) {
            chain_stage_close(&chain->stage[i]);
        }
        free(chain);
    }
}

bool chain_simulate_finite(const model_t *model, const recording_t *recording, uint64_t seed, double *position_um,
                           failure_t *failure) {
    if (!chain_simulate(model, recording, seed, position_um, failure)) {
        return false;
    }
    for (size_t k = 0; k < recording->samples; k++) {
        if (!isfinite(position_um[k])) {
            char time[QUANTITY_TEXT];
            quantity_time(time, recording_time(recording, (double)k), 1.0 / recording->sample_rate_hz);
            return fail(failure,
                        "%s: the model's position is not finite from t = %s s on: it does not hold for this drive",
                        recording->name, time);
        }
    }
    return true;
}

/* The hysteresis, and what stands before it. */
static void cut_behind_hysteresis(chain_t *chain) {
    size_t keep = 0;
    while (!block_is_hysteresis(chain->stage[keep].block)) {
        keep++;
    }
    while (chain->stages > keep + 1) {
        chain_stage_close(&chain->stage[--chain->stages]);
    }
}

/* What comes of a drive that is held for long, in front of the hysteresis, the last stage. */
static double at_hysteresis(const chain_t *chain, double drive_v) {
    signal_t signal = {.value = drive_v};
    for (size_t i = 0; i + 1 < chain->stages; i++) {
        chain_stage_settle(&chain->stage[i], &signal);
    }
    return signal.value;
}

/* The hysteresis goes from the recording's first drive to a far one and back, through the drives that are known to have
 * been before the recording. */
static void lead_there_and_back(chain_t *chain, double first_v, double far_v, const stage_setup_t *setup) {
    const chain_stage_t *hysteresis = &chain->stage[chain->stages - 1];
    double present = first_v;
    (void)lead(hysteresis, present, far_v);
    present = far_v;
    for (size_t b = 0; b < setup->befores; b++) {
        const double next = at_hysteresis(chain, setup->before_v[b]);
        (void)lead(hysteresis, present, next);
        present = next;
    }
    (void)lead(hysteresis, present, setup->befores > 0 ? at_hysteresis(chain, first_v) : first_v);
}

size_t chain_memory_determined(const model_t *model, const recording_t *recording, size_t end) {
    const double tolerance = 1e-4, *drive = recording->column[COLUMN_DRIVE];
    double *difference = allocate(end, sizeof(double)), low_v = HUGE_VAL, high_v = -HUGE_VAL, low_um = HUGE_VAL,
           high_um = -HUGE_VAL;
    size_t determined = end;
    stage_setup_t setup = {0};
    failure_t failure;
    chain_t *low = chain_open(model, recording->sample_rate_hz, 0, &failure);
    chain_t *high = chain_open(model, recording->sample_rate_hz, 0, &failure);
    for (size_t k = 0; k < end; k++) {
        low_v = fmin(low_v, drive[k]);
        high_v = fmax(high_v, drive[k]);
    }
    if (low != NULL && high != NULL && end > 0 &&
        recording_drive_before(recording, setup.before_v, &setup.befores, &failure)) {
        cut_behind_hysteresis(low);
        cut_behind_hysteresis(high);
        chain_settle(low, drive[0]);
        chain_settle(high, drive[0]);
        lead_there_and_back(low, drive[0], low_v - (high_v - low_v), &setup);
        lead_there_and_back(high, drive[0], high_v + (high_v - low_v), &setup);
        for (size_t k = 0; k < end; k++) {
            const double output = chain_step(low, drive[k]);
            difference[k] = fabs(chain_step(high, drive[k]) - output);
            low_um = fmin(low_um, output);
            high_um = fmax(high_um, output);
        }
        while (determined > 0 && difference[determined - 1] <= tolerance * (high_um - low_um)) {
            determined--;
        }
    }
    chain_close(low);
    chain_close(high);
    free(difference);
    return determined;
}

bool chain_determined_from(const model_t *model, const recording_t *recordings, size_t count, const size_t *end,
                           size_t *from) {
    const double least_part = 0.25;
    size_t used = 0, all = 0;
    for (size_t i = 0; i < count; i++) {
        from[i] = chain_memory_determined(model, &recordings[i], end[i]);
        used += end[i] - from[i];
        all += end[i];
    }
    return (double)used >= least_part * (double)all;
}

double error_take_zero(const double *measured, double *simulated, size_t samples) {
    double zero = 0.0;
    for (size_t k = 0; k < samples; k++) {
        zero += (measured[k] - simulated[k]) / (double)samples;
    }
    for (size_t k = 0; k < samples; k++) {
        simulated[k] += zero;
    }
    return zero;
}

error_measure_t measure_error(const double *measured, const double *simulated, size_t samples) {
    error_measure_t error = {0};
    double low = measured[0], high = measured[0], squares = 0.0;
    for (size_t k = 0; k < samples; k++) {
        const double difference = fabs(measured[k] - simulated[k]);
        squares += difference * difference;
        low = fmin(low, measured[k]);
        high = fmax(high, measured[k]);
        if (difference > error.max_um) {
            error.max_um = difference;
            error.max_sample = k;
        }
    }
    error.rms_um = sqrt(squares / (double)samples);
    error.nrmse_percent = 100.0 * error.rms_um / (high - low);
    return error;
}
