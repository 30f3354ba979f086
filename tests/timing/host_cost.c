/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * host_cost RECORDING.csv [--long] [WHAT=RATIO...]: what the host's work costs beside what one would write first, in
 * one run and on one core.
 *
 * Lines: "host", what, ours and the peer's number, its unit. Processor time, the best of several repetitions of each in
 * turn, so that other work on the machine falls on both. The recording is left behind for peers.py.
 * Fails where ours is not at least RATIO times the peer's. --long: files of ten million samples, too.
 */
#include "chain/chain.h"
#include "recording/recording.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SAMPLES = 400000, REPETITIONS = 5, MOST_PLAYS = 256 };

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void stop(const char *what) {
    fprintf(stderr, "host_cost: %s\n", what);
    exit(1);
}

/* Triangles of 250 samples and of slowly falling amplitude, again and again: loops within loops. (A sine would not do:
 * the chain knows where a smooth drive turns between two samples, the plain loop does not.) */
static void drive(recording_t *recording) {
    recording_create(recording, "host_cost", 10000.0, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double level = 1.0 - 0.9 * (double)(k % 50000) / 50000.0, phase = (double)(k % 500) / 250.0;
        const double u = 50.0 + 50.0 * level * (phase < 1.0 ? 2.0 * phase - 1.0 : 3.0 - 2.0 * phase);
        recording->column[COLUMN_DRIVE][k] = nearbyint(1e5 * u) / 1e5; /* as a file holds it */
    }
}

/* Operators at equal distances up to the drive's range. */
typedef struct {
    size_t plays;
    double weight[MOST_PLAYS + 1], threshold[MOST_PLAYS], memory[MOST_PLAYS];
} bank_t;

static void make_bank(bank_t *bank, size_t plays) {
    bank->plays = plays;
    bank->weight[0] = 0.2;
    for (size_t i = 0; i < plays; i++) {
        bank->weight[i + 1] = 0.1 / (double)plays;
        bank->threshold[i] = 50.0 * (double)(i + 1) / (double)(plays + 1);
        bank->memory[i] = 0.0;
    }
}

/* What one would write first. */
static void plain_loop(bank_t *bank, const double *u, double *y) {
    for (size_t k = 0; k < SAMPLES; k++) {
        double sum = bank->weight[0] * u[k];
        for (size_t i = 0; i < bank->plays; i++) {
            bank->memory[i] = fmax(u[k] - bank->threshold[i], fmin(u[k] + bank->threshold[i], bank->memory[i]));
            sum += bank->weight[i + 1] * bank->memory[i];
        }
        y[k] = sum;
    }
}

static json_t *values(const double *value, size_t count) {
    json_t *array = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(array, json_real(value[i]));
    }
    return array;
}

static void bank_model(model_t *model, const bank_t *bank) {
    failure_t failure;
    json_t *json =
        json_pack("{s:s, s:f, s:[{s:s, s:{s:f, s:o, s:o}}]}", "format", "hyst-model-1", "sample_rate_hz", 10000.0,
                  "chain", "block", "prandtl_ishlinskii", "parameters", "offset_um", 0.0, "weights",
                  values(bank->weight, bank->plays + 1), "thresholds_v", values(bank->threshold, bank->plays));
    if (json == NULL || !model_from_json(model, json, "bank", &failure)) {
        stop("no model");
    }
    json_decref(json);
}

static int floors;
static char **floor_of; /* WHAT=RATIO */
static bool below;

static void tell_of(double samples, const char *what, double ours_s, double peer_s, const char *peer) {
    printf("host %s %.6g %.6g samples/s %s\n", what, samples / ours_s, samples / peer_s, peer);
    for (int i = 0; i < floors; i++) {
        const size_t length = strlen(what);
        if (strncmp(floor_of[i], what, length) == 0 && floor_of[i][length] == '=' &&
            !(peer_s / ours_s >= strtod(floor_of[i] + length + 1, NULL))) {
            fprintf(stderr, "host_cost: %s is %.3g times %s only, %s is the floor\n", what, peer_s / ours_s, peer,
                    floor_of[i] + length + 1);
            below = true;
        }
    }
}

static void tell(const char *what, double ours_s, double peer_s, const char *peer) {
    tell_of(SAMPLES, what, ours_s, peer_s, peer);
}

static double smaller(double a, double b) {
    return a < b ? a : b;
}

static void banks(const recording_t *recording) {
    static bank_t bank;
    double *ours = malloc(SAMPLES * sizeof *ours), *theirs = malloc(SAMPLES * sizeof *theirs);
    const size_t plays[] = {10, 64, MOST_PLAYS};
    for (size_t n = 0; n < sizeof plays / sizeof plays[0]; n++) {
        double best[2] = {HUGE_VAL, HUGE_VAL}, difference = 0.0;
        failure_t failure;
        model_t model;
        make_bank(&bank, plays[n]);
        bank_model(&model, &bank);
        for (int r = 0; r < REPETITIONS; r++) {
            double start = seconds();
            if (!chain_simulate(&model, recording, 1, ours, &failure)) {
                stop("no simulation");
            }
            best[0] = smaller(best[0], seconds() - start);
            make_bank(&bank, plays[n]);
            start = seconds();
            plain_loop(&bank, recording->column[COLUMN_DRIVE], theirs);
            best[1] = smaller(best[1], seconds() - start);
        }
        for (size_t k = 0; k < SAMPLES; k++) {
            difference = fmax(difference, fabs(ours[k] - theirs[k]));
        }
        if (!(difference <= 1e-12 * 30.0)) { /* um: of the range */
            stop("the two simulations differ");
        }
        char what[40];
        snprintf(what, sizeof what, "simulate_%zu_plays", plays[n]);
        tell(what, best[0], best[1], "plain_C_loop");
        if (n == 0) {
            memcpy(recording->column[COLUMN_DISPLACEMENT], ours, SAMPLES * sizeof *ours);
        }
        model_free(&model);
    }
    free(ours);
    free(theirs);
}

/* A reader of three columns by fgets and strtod. */
static void read_plainly(const char *path, double *column[3]) {
    char line[200];
    size_t k = 0;
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        char *at = line;
        if (line[0] != '#' && line[0] != 't' && k < SAMPLES) {
            for (int c = 0; c < 3; c++) {
                column[c][k] = strtod(at, &at);
                at += *at == ',';
            }
            k++;
        }
    }
    if (file == NULL || k != SAMPLES) {
        stop("the plain reader reads something else");
    }
    fclose(file);
}

/* A writer that keeps every bit, by fprintf. */
static void write_plainly(const char *path, const recording_t *recording) {
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        stop("the plain writer cannot write");
    }
    for (size_t k = 0; k < SAMPLES; k++) {
        fprintf(file, "%.9f,%.17g,%.17g\n", (double)k / 10000.0, recording->column[COLUMN_DRIVE][k],
                recording->column[COLUMN_DISPLACEMENT][k]);
    }
    fclose(file);
}

static void files(const recording_t *recording, const char *path) {
    char other[1000];
    double *column[3];
    double best[4] = {HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL};
    snprintf(other, sizeof other, "%s.plain", path);
    for (int c = 0; c < 3; c++) {
        column[c] = malloc(SAMPLES * sizeof(double));
    }
    for (int r = 0; r < REPETITIONS; r++) {
        recording_t back;
        failure_t failure;
        double start = seconds();
        if (!recording_write(recording, path, &failure)) {
            stop("no recording written");
        }
        best[0] = smaller(best[0], seconds() - start);
        start = seconds();
        write_plainly(other, recording);
        best[1] = smaller(best[1], seconds() - start);
        start = seconds();
        if (!recording_read(&back, path, &failure)) {
            stop("no recording read");
        }
        best[2] = smaller(best[2], seconds() - start);
        start = seconds();
        read_plainly(path, column);
        best[3] = smaller(best[3], seconds() - start);
        for (size_t k = 0; k < SAMPLES; k++) {
            if (back.column[COLUMN_DISPLACEMENT][k] != recording->column[COLUMN_DISPLACEMENT][k] ||
                column[2][k] != recording->column[COLUMN_DISPLACEMENT][k]) {
                stop("what was read is not what was written");
            }
        }
        recording_free(&back);
    }
    remove(other);
    tell("write_CSV", best[0], best[1], "fprintf");
    tell("read_CSV", best[2], best[3], "fgets_and_strtod");
    for (int c = 0; c < 3; c++) {
        free(column[c]);
    }
}

/* HDF5 beside the project's CSV, which is several times faster than what one would write first. */
static void long_files(const char *path) {
    enum { LONG = 10000000 };
    char name[2][1000];
    double best[4] = {HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL};
    recording_t recording;
    snprintf(name[0], sizeof name[0], "%s.long.h5", path);
    snprintf(name[1], sizeof name[1], "%s.long.csv", path);
    recording_create(&recording, "host_cost", 10000.0, LONG);
    for (size_t k = 0; k < LONG; k++) {
        recording.column[COLUMN_DRIVE][k] = nearbyint(5e6 + 5e6 * sin(1e-3 * (double)k)) / 1e5;
        recording.column[COLUMN_DISPLACEMENT][k] = 15.0 + 15.0 * sin(1e-3 * (double)k - 0.1);
    }
    for (int r = 0; r < REPETITIONS; r++) {
        for (int kind = 0; kind < (r == 0 ? 2 : 1); kind++) { /* the CSV once */
            recording_t back;
            failure_t failure;
            double start = seconds();
            if (!recording_write(&recording, name[kind], &failure)) {
                stop(failure.text);
            }
            best[kind] = smaller(best[kind], seconds() - start);
            start = seconds();
            if (!recording_read(&back, name[kind], &failure)) {
                stop(failure.text);
            }
            best[2 + kind] = smaller(best[2 + kind], seconds() - start);
            for (int c = COLUMN_DRIVE; c <= COLUMN_DISPLACEMENT; c++) {
                for (size_t k = 0; k < LONG; k++) {
                    if (back.column[c][k] != recording.column[c][k]) {
                        stop("what was read is not what was written");
                    }
                }
            }
            recording_free(&back);
        }
    }
    remove(name[0]);
    remove(name[1]);
    tell_of(LONG, "write_HDF5_of_1e7", best[0], best[1], "the_same_as_CSV");
    tell_of(LONG, "read_HDF5_of_1e7", best[2], best[3], "the_same_as_CSV");
    recording_free(&recording);
}

int main(int argc, char **argv) {
    recording_t recording;
    if (argc < 2) {
        stop("which recording to write?");
    }
    const bool with_long = argc > 2 && strcmp(argv[2], "--long") == 0;
    floor_of = argv + (with_long ? 3 : 2);
    floors = argc - (with_long ? 3 : 2);
    drive(&recording);
    banks(&recording);
    files(&recording, argv[1]);
    recording_free(&recording);
    if (with_long) {
        long_files(argv[1]);
    }
    return below ? 1 : 0;
}
