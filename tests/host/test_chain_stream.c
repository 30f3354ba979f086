/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A stream gives what the simulation of the whole gives, to the bit, wherever the signal is cut and the chain begins.
 */
#include "chain/chain_stream.h"
#include "support.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>

enum { RUNS = 60, STAGES = 9 };

static const double rate_hz = 2000.0;

void setUp(void) {
}
void tearDown(void) {
}

static void append(model_t *model, const block_t *block, const char *name, double value) {
    model_set(model_append(model, block), name, value);
}

/* All that looks ahead, all that hands more than a value to the hysteresis, and what counts samples. */
static void make_chain(model_t *model) {
    const double weights[] = {0.08, 0.03, 0.02}, thresholds[] = {5.0, 20.0};
    make_bank_model(model, rate_hz, 2.0, 2, weights, thresholds);
    append(model, &block_transport_delay, "delay_s", 0.3 / rate_hz);
    append(model, &block_amplifier_bandwidth, "cutoff_hz", 120.0);
    const model_block_t bank = model->block[0];
    model->block[0] = model->block[1];
    model->block[1] = model->block[2];
    model->block[2] = bank;
    append(model, &block_asymmetric_hysteresis, "asymmetry", 0.1);
    model_set(&model->block[3], "half_range_v", 60.0);
    append(model, &block_rate_dependent_hysteresis, "beta_s", 1e-3);
    append(model, &block_creep, "gamma_per_decade", 0.01);
    append(model, &block_resonance, "frequency_hz", 150.0);
    model_set(&model->block[6], "damping_ratio", 0.1);
    append(model, &block_sensor_bandwidth, "cutoff_hz", 300.0);
    append(model, &block_mains_interference, "frequency_hz", 50.0);
    model_set(&model->block[8], "amplitude_um", 0.1);
    TEST_ASSERT_EQUAL_UINT64(STAGES, model->blocks);
}

/* chain_simulate is a stream itself. */
static void expect_as_in_one_piece(const recording_t *recording, const model_t *model) {
    signal_t *signal = allocate(recording->samples + 1, sizeof *signal);
    size_t order[MODEL_MAX_BLOCKS];
    failure_t failure;
    signal[0].value = recording->column[COLUMN_DRIVE][0];
    for (size_t k = 0; k < recording->samples; k++) {
        signal[1 + k].value = recording->column[COLUMN_DRIVE][k];
    }
    TEST_ASSERT_TRUE(chain_run(model, recording, 0, 0, chain_order(model, order), signal, &failure));
    for (size_t k = 0; k < recording->samples; k++) {
        TEST_ASSERT_TRUE(signal[1 + k].value == recording->column[COLUMN_DISPLACEMENT][k]);
    }
    free(signal);
}

/* Smooth first, where looking ahead tells a curve from a line, then rough. */
static void make_recording(recording_t *recording, const model_t *model, size_t samples, random_t *random) {
    const double cycles = 0.05 * random_unit(random);
    recording_create(recording, "streamed", rate_hz, samples);
    for (size_t k = 0; k < samples; k++) {
        recording->column[COLUMN_DRIVE][k] =
            40.0 * cos(6.28 * cycles * (double)k) + (k > samples / 2 ? 10.0 * random_normal(random) : 0.0);
    }
    simulate_into(recording, model, 0);
    expect_as_in_one_piece(recording, model);
}

static size_t up_to(random_t *random, size_t most) {
    return (size_t)random_between(random, 0, (int32_t)most);
}

/* One piece after the other, short ones and long ones, and the end sometimes by itself behind the last. */
static void cut(stream_piece_t *piece, const recording_t *recording, size_t start, random_t *random) {
    const size_t left = recording->samples - start, most = random_unit(random) < 0.5 ? 5 : STREAM_PIECE;
    piece->count = up_to(random, left < most ? left : most);
    piece->ends = piece->count == left && random_unit(random) < 0.5;
    for (size_t k = 0; k < piece->count; k++) {
        piece->signal[k] = (signal_t){.value = recording->column[COLUMN_DRIVE][start + k]};
    }
}

/* Whole, and from each stage on, fed with what enters there. */
static void stream_along(const model_t *model, const recording_t *recording, random_t *random) {
    const stage_setup_t setup = {.sample_rate_hz = rate_hz};
    chain_stream_t stream[STAGES];
    signal_t settled[MODEL_MAX_BLOCKS];
    stream_piece_t *piece = allocate(1, sizeof *piece), *entered = allocate(STAGES, sizeof *entered);
    size_t done = 0;
    for (size_t s = 0; s < STAGES; s++) {
        stream[s] = chain_stream_open(model, s, &setup);
    }
    chain_stream_settle(&stream[0], (signal_t){.value = recording->column[COLUMN_DRIVE][0]}, settled);
    for (size_t s = 1; s < STAGES; s++) {
        chain_stream_settle(&stream[s], settled[s], NULL);
    }
    for (size_t start = 0; !piece->ends; start += piece->count) {
        cut(piece, recording, start, random);
        chain_stream_run(&stream[0], piece->signal, piece->count, piece->ends, entered);
        for (size_t s = 0; s < STAGES; s++) {
            if (s > 0) {
                chain_stream_run(&stream[s], entered[s].signal, entered[s].count, entered[s].ends, NULL);
            }
            TEST_ASSERT_EQUAL_UINT64(stream[0].out, stream[s].out);
            for (size_t j = 0; j < stream[s].out; j++) {
                TEST_ASSERT_TRUE(stream[s].signal[j].value == recording->column[COLUMN_DISPLACEMENT][done + j]);
            }
        }
        done += stream[0].out;
    }
    TEST_ASSERT_EQUAL_UINT64(recording->samples, done);
    for (size_t s = 0; s < STAGES; s++) {
        chain_stream_close(&stream[s]);
    }
    free(piece);
    free(entered);
}

static void test_cuts_change_nothing(void) {
    random_t random = random_start("chain_stream_cuts", 20261122);
    model_t model;
    make_chain(&model);
    for (size_t run = 0; run < RUNS; run++) {
        recording_t recording;
        make_recording(&recording, &model, 1 + up_to(&random, run < RUNS / 2 ? 40 : 3 * STREAM_PIECE), &random);
        stream_along(&model, &recording, &random);
        recording_free(&recording);
    }
    model_free(&model);
}

/* A part of a recording takes no more of its drive than the stages look ahead, and comes out as in the whole. */
static void test_fills_as_far_as_asked(void) {
    random_t random = random_start("chain_stream_fill", 20261123);
    const stage_setup_t setup = {.sample_rate_hz = rate_hz};
    stream_piece_t *piece = allocate(1, sizeof *piece);
    model_t model;
    make_chain(&model);
    for (size_t run = 0; run < RUNS; run++) {
        recording_t recording;
        size_t start = 0, done = 0;
        make_recording(&recording, &model, 1 + up_to(&random, 3 * STREAM_PIECE), &random);
        const size_t behind = up_to(&random, run % 2 == 0 || recording.samples < 30 ? recording.samples - 1 : 25);
        const size_t end = recording.samples - behind;
        chain_stream_t stream = chain_stream_open(&model, 0, &setup);
        chain_stream_settle(&stream, (signal_t){.value = recording.column[COLUMN_DRIVE][0]}, NULL);
        for (; done < end; start += piece->count) {
            chain_stream_fill(&stream, &recording, start, end, piece);
            TEST_ASSERT_TRUE(piece->count > 0 && piece->count <= STREAM_PIECE);
            chain_stream_run(&stream, piece->signal, piece->count, piece->ends, NULL);
            for (size_t j = 0; j < stream.out; j++, done++) {
                TEST_ASSERT_TRUE(stream.signal[j].value == recording.column[COLUMN_DISPLACEMENT][done]);
            }
        }
        TEST_ASSERT_TRUE(start <= end + SIGNAL_AHEAD * STAGES);
        chain_stream_close(&stream);
        recording_free(&recording);
    }
    free(piece);
    model_free(&model);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_cuts_change_nothing);
    RUN_TEST(test_fills_as_far_as_asked);
    return UNITY_END();
}
