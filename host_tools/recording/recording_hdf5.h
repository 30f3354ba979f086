/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Recordings as HDF5, for long ones: the columns as they are in memory, bit for bit.
 *
 * The file is one that netCDF-4 and xarray open. Group / has the attributes of the recording: `format`
 * ("hyst-recording-1"), `sample_rate_hz` and `start_s`, each header key as text, in their order; and where it comes
 * from: `Conventions`, `history` (date and command), `source_files` (SHA-256 and name, a line each), `device`,
 * `hyst_version`. `time` in s is the dimension scale of the data sets `drive`, `displacement` and the others; each is a
 * row of 64-bit floating point numbers with an attribute `units`. Sample times follow from the rate and the start.
 * Further columns of the file of origin are data sets like these, used by nothing and kept. Each has `units` if that
 * file says it, and `long_name` where its name there is no safe name of a data set.
 */
#ifndef RECORDING_HDF5_H
#define RECORDING_HDF5_H

#include "recording/recording.h"

/** Whether the name of a file says that it is HDF5: .h5, .hdf5, .nc. */
bool hdf5_is_named(const char *path);

/** Whether a file is a recording in this format. */
bool hdf5_is_recording(const char *path);

/** As recording_read and recording_write do, which call these. */
bool hdf5_read_recording(recording_t *recording, const char *path, failure_t *failure);
bool hdf5_write_recording(const recording_t *recording, const char *path, failure_t *failure);

#endif
