/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Recordings: uniformly sampled drive and displacement, as CSV.
 *
 *     # sample_rate_hz: 10000
 *     # drive_unit: V
 *     # displacement_unit: um
 *     # any_other_key: value
 *     t,drive,displacement
 *     0.0000,50.00000,0.01234
 *
 * Header lines start with '#'. Columns are named and may stand in any order; t [s], drive [V] and displacement [um] are
 * required, reference [um], voltage [V], current [A] and temperature [degC] are optional. Other columns are kept beside
 * them (recording_extra_t), with the header keys NAME_unit and NAME_long_name; text in them is no number, and a column
 * of nothing else is left out.
 * Nothing is repaired: a gap, a duplicate, a number that is not one, a ragged or over-long line, a missing column, a
 * rate that t contradicts or binary data is refused with one line that names file and line.
 *
 * A file that does not begin with such a header is imported by import.h, if that needs no options.
 */
#ifndef RECORDING_H
#define RECORDING_H

#include "base/failure.h"
#include "recording/table/column.h"
#include <stdbool.h>
#include <stddef.h>

/** Largest magnitude of a value in V, um, A or degC. A megavolt or a metre is no piezo actuator but a wrong unit, a
 * broken line, or a sensor's mark for "no reading"; let through, one such value decides every fit. */
#define RECORDING_LARGEST 1e6
/** Faster than any oscilloscope, Hz: no sample rate. */
#define RECORDING_FASTEST_HZ 1e11

/** Most extra columns that a CSV has; HDF5 has any number. */
#define RECORDING_CSV_EXTRAS 240
/** Longest line of a recording in characters: as many columns with the longest names. */
#define RECORDING_MAX_LINE 32000

/** A column without a meaning here, as its file has it: kept, and used by nothing. */
typedef struct {
    char *name;      /**< its name in the file: letters, digits and underscores, and no other column's */
    char *long_name; /**< its name in the file of origin, where that is another; else "" */
    char *unit;      /**< as its file has it; "" where that says none */
    double *value;   /**< samples values; they may be no numbers */
} recording_extra_t;

/** A header line that is not one of the three keys with a meaning here. */
typedef struct {
    char *key, *value;
} recording_key_t;

typedef struct recording {
    char *name; /**< path it was read from, for messages */
    double sample_rate_hz;
    double start_s;               /**< t of the first sample; recording_time */
    double clock_s;               /**< start on a clock shared by recordings (line_clock.h); 0: unknown */
    size_t samples;               /**< 2 or more after a successful read */
    double *column[COLUMN_COUNT]; /**< samples values each, NULL where the recording has no such column */
    size_t extras;
    recording_extra_t *extra;
    size_t keys;
    recording_key_t *key;
    char *understood;  /**< for a file of another format: how its columns were interpreted, some lines; else NULL */
    bool held;         /**< the drive goes out by a converter that holds each value until the next */
    double held_since; /**< then: parts of a sample from when a row's drive went out until its position was read, 0
                          to 1 */
    size_t steps; /**< held steps in which the drive goes from row to row (chain/align.h); 0: it moves, or is held */
    unsigned char *masked; /**< 1 for each sample whose displacement is excluded (recording_mask); NULL: none */
    struct recording
        *whole; /**< of which this is a part (diagnosis/question/excerpt.h), freed with it; NULL: it is whole */
} recording_t;

/** How long each value of the drive is held; 0: it is not. */
static inline double recording_held_s(const recording_t *recording) {
    return recording->held ? 1.0 / recording->sample_rate_hz : 0.0;
}
/** The shortest time for which a value of these drives is held; 0: one of them is not held. */
double recordings_held_s(const recording_t *recordings, size_t count);

/** Reads and checks a file. On success the caller frees *recording with recording_free. */
bool recording_read(recording_t *recording, const char *path, failure_t *failure);

/** Whether a file has this project's format, CSV or HDF5, and so is not imported. Its contents may still be wrong. */
bool recording_is_own(const char *path);
/** Adds the header keys of a file of this project's format, also of a CSV that a spreadsheet has written anew. */
void recording_take_keys(recording_t *recording, const char *path);
/** The same of a CSV: none that the recording has, and those of no file without the key sample_rate_hz. */
void recording_take_header(recording_t *recording, const char *path);
/** Takes off what a spreadsheet writes behind a remark: the separators of empty cells. */
void recording_cut_cells(char *text);

/** Writes a file that recording_read reads back to the same numbers (17 digits where needed), with all columns with a
 * meaning and the first RECORDING_CSV_EXTRAS others. A name that ends in .h5, .hdf5 or .nc makes an HDF5 file
 * (recording_hdf5.h): faster by far, bit for bit, and with all extra columns. */
bool recording_write(const recording_t *recording, const char *path, failure_t *failure);

/** An empty recording of `samples` zeroed samples with drive and displacement. Further columns: recording_add_column.
 */
void recording_create(recording_t *recording, const char *name, double sample_rate_hz, size_t samples);
/** A copy of so many samples from `first` on, with all its columns, keys and marks, but without what it may be a part
 * of. They keep their times, and the drives before them (below). Free both. */
void recording_copy(recording_t *copy, const recording_t *recording, size_t first, size_t samples);
/** Adds a zeroed column unless it exists. Returns its values. */
double *recording_add_column(recording_t *recording, column_t column);
/** Adds a column without a meaning here. Of its name a safe one is made that no other column has. long_name: as its
 * file has it; "": just so. All is copied. */
void recording_add_extra(recording_t *recording, const char *name, const char *long_name, const char *unit,
                         const double *value);
/** Leaves the displacement of samples [from, to) out: they are marked, and hold a straight line between the readings
 * beside them, so that filters over time pass. What is written to a file is not marked. */
void recording_mask(recording_t *recording, size_t from, size_t to);
/** Drops all samples but `samples` from `first` on; they keep their times, and the drives before them (below). */
void recording_keep(recording_t *recording, size_t first, size_t samples);
/** Keeps every so many samples only, from `first` on. What the drive did between them is lost: it counts as a straight
 * line where it was held. */
void recording_keep_every(recording_t *recording, size_t first, size_t every);
/** Time of a sample, or of a place between two, as the file tells it: all that is printed is in these times. */
double recording_time(const recording_t *recording, double sample);

/** Drops what was recorded before from_s and from to_s on, by the recording's own times. Fails if no sample is left. */
bool recording_span(recording_t *recording, double from_s, double to_s, failure_t *failure);
/** Adds or replaces a header key. Keys and values are one line each. */
void recording_set_key(recording_t *recording, const char *key, const char *value);
/** The value of a header key, or NULL. */
const char *recording_key(const recording_t *recording, const char *key);
/** Force on the actuator in N: header key preload_n, 0 without. Fails unless it is a number of 0 or more. */
bool recording_preload(const recording_t *recording, double *preload_n, failure_t *failure);

/** Whether a header key says what the numbers of a file are, as sample_rate_hz does and all that end in _unit do:
 * recordings in memory have them in the project's own units, and no such key. */
bool recording_is_unit_key(const char *key);
/** What the drive does between two samples. The kind of hardware decides; the header key drive_between_samples says it.
 */
typedef enum {
    BETWEEN_UNKNOWN,
    BETWEEN_HELD,  /**< a converter holds each value until the next */
    BETWEEN_LINE,  /**< a straight line */
    BETWEEN_SMOOTH /**< so smooth that held at once and filtered, line or curve differ by less than 0.1 % of the range
                    */
} drive_between_t;
/** As the header key has it: unknown, held, line, smooth. */
const char *drive_between_name(drive_between_t between);
/** Of the header key drive_between_samples; BETWEEN_UNKNOWN without it. Fails unless it is one of the other three. */
bool recording_drive_between(const recording_t *recording, drive_between_t *between, failure_t *failure);

/** The drive before the recording: header key drive_before_v, its turning points in V, the oldest first ("0, 100, 0").
 * From the last one the drive went to the first of the recording. *points is how many, 0 without the key. Fails unless
 * they are at most RECORDING_MOST_BEFORE finite numbers. */
#define RECORDING_BEFORE_KEY "drive_before_v"
enum { RECORDING_MOST_BEFORE = 16 };
bool recording_drive_before(const recording_t *recording, double before_v[RECORDING_MOST_BEFORE], size_t *points,
                            failure_t *failure);
/** Where the recording has that key: so many samples of this drive are left out in front of it, and count as drives
 * before it. Of more than RECORDING_MOST_BEFORE turning points that a hysteresis would remember, the innermost are
 * dropped. */
void recording_move_before(recording_t *recording, const double *drive, size_t samples);

/** How long after the instant of the drive in the same row the position was sampled, in s; negative: before. Header key
 * displacement_sampled_after_s, 0 without. Fails unless it is a finite number. */
bool recording_sampled_after(const recording_t *recording, double *after_s, failure_t *failure);

/** Header keys of the amplifier that it was recorded with: board, serial number and firmware; the number alone. What is
 * read is noted for the results' origin (base/provenance.h). */
#define RECORDING_DEVICE_KEY "device"
#define RECORDING_SERIAL_KEY "amplifier_serial"

/** The supply of the amplifier's power stage, in V at the actuator: the least that was measured during the recording.
 * Header key stage_supply_v; HUGE_VAL without. Fails unless it is a number above 0. */
#define STAGE_SUPPLY_KEY "stage_supply_v"
bool recording_stage_supply(const recording_t *recording, double *supply_v, failure_t *failure);

/** Whether the values of all these header keys are what they may be. recording_read has asked. */
bool recording_check_keys(const recording_t *recording, failure_t *failure);

/** Smallest and largest of count values; count > 0. */
void values_range(const double *values, size_t count, double range[2]);
/** The highest sample rate of these recordings: what is quickest shows there. */
double recordings_fastest_hz(const recording_t *recordings, size_t count);
/** values_range over a column that all of these recordings have. */
void recordings_range(const recording_t *recordings, size_t count, column_t column, double range[2]);

/** Zeroed arrays with one value per sample of each recording; to be freed with recordings_room_free. */
double **recordings_room(const recording_t *recordings, size_t count);
void recordings_room_free(double **room, size_t count);

/** Frees what the recording holds and clears it. A cleared recording may be freed again. */
void recording_free(recording_t *recording);

#endif
