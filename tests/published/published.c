/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * published FOLDER: writes FOLDER/QUESTION/NAME.csv, loops rebuilt from what the papers print, and FOLDER/numbers.json,
 * what follows from the print by itself. With HYST_RECORDINGS in the environment also what follows from the real
 * recordings that are there. The questions are in questions.json.
 */
#include "campaign_000.h"
#include "ellipses_003.h"
#include "numbers.h"
#include "printed_004.h"
#include "random.h"
#include "record_001.h"
#include "twins/twin_001.h"
#include "twins/twin_003.h"
#include <errno.h>
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Writes the recording and frees it. */
static bool hand_out(const char *folder, const char *question, double frequency_hz, const char *note,
                     recording_t *recording, failure_t *failure) {
    char path[1000];
    bool good = true;
    snprintf(path, sizeof path, "%s/%s", folder, question);
    if (mkdir(path, 0777) != 0 && errno != EEXIST) {
        good = fail(failure, "%s: %s", path, strerror(errno));
    }
    if (good) {
        snprintf(path, sizeof path, "%s/%s/%s%05.1fhz.csv", folder, question, note, frequency_hz);
        good = recording_write(recording, path, failure);
    }
    recording_free(recording);
    return good;
}

/* ---- 003: the nine ellipses of table 1 ---- */

/* The paper samples at 10 kHz; half of that keeps the nine loops short. 16 bits over both ranges as printed; the noise
 * is chosen. At 0.5 Hz a period and a half: in the first half the drive has not been at both ends yet. */
static bool write_003(const char *folder, failure_t *failure) {
    const double rate_hz = 5000.0, noise_um = 0.01, code = 1.0 / 65536.0;
    random_t random = {2003};
    bool good = true;
    for (size_t i = 0; good && i < ELLIPSES_003; i++) {
        const ellipse_003_t *row = &ellipses_003[i];
        const double seconds = fmax(0.3, 1.5 / row->frequency_hz);
        recording_t recording;
        recording_create(&recording, "table 1 of 003", rate_hz, (size_t)(seconds * rate_hz));
        for (size_t k = 0; k < recording.samples; k++) {
            double drive_v, y;
            ellipse_003_point(row, 2.0 * M_PI * row->frequency_hz * (double)k / rate_hz, &drive_v, &y);
            y += noise_um * random_normal(&random);
            recording.column[COLUMN_DRIVE][k] =
                TWIN_003_DRIVE_V * code * floor(drive_v / TWIN_003_DRIVE_V / code + 0.5);
            recording.column[COLUMN_DISPLACEMENT][k] =
                TWIN_003_RANGE_UM * code * floor(y / TWIN_003_RANGE_UM / code + 0.5);
        }
        good = hand_out(folder, "003", row->frequency_hz, "", &recording, failure);
    }
    return good;
}

/* ---- 000: the campaign without preload, on the twin ---- */

static bool write_000(const char *folder, failure_t *failure) {
    static const double frequency_hz[] = {10.0, 25.0, 50.0, 100.0, 125.0, 200.0};
    static const double volts[] = {40.0, 80.0};
    bool good = true;
    for (size_t v = 0; v < sizeof volts / sizeof volts[0]; v++) {
        for (size_t f = 0; good && f < sizeof frequency_hz / sizeof frequency_hz[0]; f++) {
            run_t run = {.volts = volts[v], .frequency_hz = frequency_hz[f]};
            campaign_record(&run, 10 * v + f + 1);
            good = hand_out(folder, "000", frequency_hz[f], v == 0 ? "40v-" : "80v-", &run.recording, failure);
        }
    }
    return good;
}

/* ---- 001: the frequencies that the paper shows, on the twin ---- */

static bool write_001(const char *folder, failure_t *failure) {
    static const double frequency_hz[] = {1.0, 15.0, 25.0, 30.0, 35.0, 70.0, 71.0, 72.0, 73.0, 80.0, 95.0};
    bool good = true;
    for (size_t f = 0; good && f < sizeof frequency_hz / sizeof frequency_hz[0]; f++) {
        recording_t recording;
        seed_001_record(&recording, frequency_hz[f], TWIN_001_RANGE_V, fmax(0.6, 1.5 / frequency_hz[f]), f + 1);
        good = hand_out(folder, "001", frequency_hz[f], "", &recording, failure);
    }
    if (good) {
        recording_t recording;
        seed_001_record(&recording, 80.0, TWIN_001_RANGE_V, 2.0, 80);
        good = hand_out(folder, "001-interleaved", 80.0, "", &recording, failure);
    }
    return good;
}

/* ---- 004: the printed model, and the same bank behind a delay ---- */

static bool write_004(const char *folder, failure_t *failure) {
    static const double frequency_hz[] = {10.0, 50.0, 100.0, 200.0};
    const printed_004_rate_t printed = {.beta_s = printed_004_beta_s}, delayed = {.delay_s = numbers_004_delay_s()};
    bool good = true;
    for (size_t f = 0; good && f < sizeof frequency_hz / sizeof frequency_hz[0]; f++) {
        recording_t recording;
        printed_004_record(&recording, frequency_hz[f], printed, 0.6, f + 1);
        good = hand_out(folder, "004", frequency_hz[f], "", &recording, failure);
        if (good) {
            printed_004_record(&recording, frequency_hz[f], delayed, 0.6, f + 11);
            good = hand_out(folder, "004-delay", frequency_hz[f], "", &recording, failure);
        }
    }
    return good;
}

static bool write_numbers(const char *folder, failure_t *failure) {
    char path[1000];
    json_t *numbers = json_object();
    const char *recordings = getenv("HYST_RECORDINGS");
    bool good =
        numbers_printed(numbers, failure) && (recordings == NULL || numbers_measured(recordings, numbers, failure));
    if (good) {
        snprintf(path, sizeof path, "%s/numbers.json", folder);
        if (json_dump_file(numbers, path, JSON_INDENT(1)) != 0) {
            good = fail(failure, "%s: cannot be written", path);
        }
    }
    json_decref(numbers);
    return good;
}

int main(int argc, char **argv) {
    failure_t failure;
    if (argc != 2) {
        fprintf(stderr, "usage: published FOLDER\n");
        return 2;
    }
    if (!write_003(argv[1], &failure) || !write_000(argv[1], &failure) || !write_001(argv[1], &failure) ||
        !write_004(argv[1], &failure) || !write_numbers(argv[1], &failure)) {
        fprintf(stderr, "published: %s\n", failure.text);
        return 1;
    }
    return 0;
}
