/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The library of the host for other languages: read a recording or make one of arrays, fit, simulate, diagnose,
 * compile, and work an amplifier. What the commands of `hyst` do is done by the same functions here.
 *
 * - Handles are opaque. Each is freed by its own function, which takes NULL. A handle is used by one thread at a time;
 *   different handles by different threads.
 * - A function that fails returns NULL or 0. hyst_host_error then has the line that the command would print.
 * - Nothing prints, ends the process, or changes how it takes signals. Out of memory aborts.
 * - Arrays go in and out as double, one value a sample, in V, um, A, degC, s and Hz. A pointer to a column belongs to
 *   its handle, and is valid until that is freed. Texts are UTF-8; those that are not const are the caller's, to be
 *   freed by hyst_host_free.
 * - Options and answers with many parts are JSON objects as text. An option that is absent or null has its default; an
 *   unknown one is refused, and so is a range [low, high] that does not go up.
 * - Fits and diagnoses ("long work") run one at a time in a process, in the thread that calls. Any thread may ask them
 *   to end with hyst_host_cancel: they then fail with "interrupted", within about a second of a processor's time.
 *
 * A function is never changed or taken away within one hyst_host_interface_version; new ones may come.
 */
#ifndef HYST_INTERFACE_H
#define HYST_INTERFACE_H

#include <stddef.h>

#if defined(__GNUC__)
#define HYST_HOST __attribute__((visibility("default")))
#else
#define HYST_HOST
#endif

typedef struct hyst_host_recording hyst_host_recording_t;
typedef struct hyst_host_model hyst_host_model_t;
typedef struct hyst_host_diagnosis hyst_host_diagnosis_t;
typedef struct hyst_host_device hyst_host_device_t;

/** 1. */
HYST_HOST unsigned hyst_host_interface_version(void);
/** Version of the project, "0.1.0". */
HYST_HOST const char *hyst_host_version(void);
/** The line of the last failure in this thread, without a newline. Valid until the thread's next failure. */
HYST_HOST const char *hyst_host_error(void);
/** Frees a text or bytes that a function gave. */
HYST_HOST void hyst_host_free(void *memory);

/**
 * Called in the thread that works, when a piece of long work has come on: what is done, "fitting", "looking",
 * "diagnosing: search" .., and how much of that piece, 0 to 1. An answer other than 0 asks the work to end, as
 * hyst_host_cancel does. Must not call long work.
 */
typedef int hyst_host_progress_t(void *context, const char *what, double fraction);
/** Of the long work that this thread begins from now on; NULL, the default: none. */
HYST_HOST void hyst_host_on_progress(hyst_host_progress_t *progress, void *context);
/** Asks all long work of the process to end. It holds until taken back (0), which is due before the next. */
HYST_HOST void hyst_host_cancel(int cancel);

/* ------------------------------------------------------------------------------------------------- recordings --- */

/**
 * Reads a file of any kind that `hyst import` reads. options: NULL, or an object with "time", "sample_rate_hz",
 * "column": {"drive": name or number, ..}, "scale": {"drive": factor, ..} and "fill_missing": true, each as the options
 * of that command.
 */
HYST_HOST hyst_host_recording_t *hyst_host_recording_read(const char *path, const char *options);
/** An empty one of `samples` zeros in drive and displacement. At least 2 samples; a rate above 0. */
HYST_HOST hyst_host_recording_t *hyst_host_recording_make(const char *name, double sample_rate_hz, size_t samples);
/** One of arrays with names and units ("s", "V", "nm", ..; "": unknown), `samples` values each, understood as a file
 * with these columns would be: time stamps that jitter are resampled, gaps refused. options as of
 * hyst_host_recording_read; and "file", which the arrays were read from: pages name it.
 */
HYST_HOST hyst_host_recording_t *hyst_host_recording_import(const char *name, size_t samples, size_t columns,
                                                            const char *const *column, const char *const *unit,
                                                            const double *const *values, const char *options);
/** Copies the samples in. column: "drive", "displacement", "reference", "voltage", "current", "temperature". Values as
 * in a file: finite, and at most 1e6. */
HYST_HOST int hyst_host_recording_set_column(hyst_host_recording_t *recording, const char *column,
                                             const double *values);
/** NULL: the recording has no such column (this is no failure). */
HYST_HOST const double *hyst_host_recording_column(const hyst_host_recording_t *recording, const char *column);
HYST_HOST size_t hyst_host_recording_samples(const hyst_host_recording_t *recording);
HYST_HOST double hyst_host_recording_sample_rate_hz(const hyst_host_recording_t *recording);
/** Time of the first sample; and setting it. */
HYST_HOST double hyst_host_recording_start_s(const hyst_host_recording_t *recording);
HYST_HOST void hyst_host_recording_set_start_s(hyst_host_recording_t *recording, double start_s);
HYST_HOST const char *hyst_host_recording_name(const hyst_host_recording_t *recording);
/** How the columns of another format were understood, some lines; "" for the project's own. */
HYST_HOST const char *hyst_host_recording_understood(const hyst_host_recording_t *recording);
/** The header's keys as a JSON object of texts; and one more of them, which is none of sample_rate_hz, drive_unit and
 * the like. */
HYST_HOST char *hyst_host_recording_keys(const hyst_host_recording_t *recording);
HYST_HOST int hyst_host_recording_set_key(hyst_host_recording_t *recording, const char *key, const char *value);
/** The columns of the file of origin that are none of the above, as a JSON array: "name", "long_name" (as that file has
 * it) and "unit" ("": it says none) of each. And the values of one, by its place in the array. */
HYST_HOST char *hyst_host_recording_extras(const hyst_host_recording_t *recording);
HYST_HOST const double *hyst_host_recording_extra(const hyst_host_recording_t *recording, size_t place);
/** A copy with the drive at the instants at which the position was sampled, as the header key
 * displacement_sampled_after_s says (chain/align.h): what fit and diagnose make of a recording before they use it. */
HYST_HOST hyst_host_recording_t *hyst_host_recording_aligned(const hyst_host_recording_t *recording);
/** A copy of what was recorded from from_s on and before to_s, by its own times; NULL: that is no sample. */
HYST_HOST hyst_host_recording_t *hyst_host_recording_span(const hyst_host_recording_t *recording, double from_s,
                                                          double to_s);
HYST_HOST int hyst_host_recording_write(const hyst_host_recording_t *recording, const char *path);
HYST_HOST void hyst_host_recording_free(hyst_host_recording_t *recording);

/** `hyst look`: answers as the command with --json, without "format". text (may be NULL) receives what it prints. */
HYST_HOST char *hyst_host_look(const hyst_host_recording_t *const *recordings, size_t count, char **text);

/* ----------------------------------------------------------------------------------------------------- models --- */

HYST_HOST hyst_host_model_t *hyst_host_model_read(const char *path);
HYST_HOST hyst_host_model_t *hyst_host_model_from_json(const char *json);
HYST_HOST char *hyst_host_model_to_json(const hyst_host_model_t *model);
HYST_HOST int hyst_host_model_write(const hyst_host_model_t *model, const char *path);
HYST_HOST void hyst_host_model_free(hyst_host_model_t *model);

/** 0, and an error that says so and ends with `hint`, if drive and displacement of a recording are exchanged: `hyst
 * fit` and `hyst diagnose` refuse it then. */
HYST_HOST int hyst_host_columns_check(const hyst_host_recording_t *const *recordings, size_t count, const char *hint);

/** The families that can be fitted: [{"name":, "text":, "one_sine": whether it holds for the recorded sine only}, ..].
 */
HYST_HOST char *hyst_host_families(void);
/** `hyst fit`: options "family", "operators" (a number; null: auto), "creep" and "use_all" (booleans). */
HYST_HOST hyst_host_model_t *hyst_host_fit(const hyst_host_recording_t *const *recordings, size_t count,
                                           const char *options);
/**
 * `hyst simulate`: the model's position for this drive, from rest at its first value. options: NULL, or "preload_n" and
 * "seed" (of noise; 1). position_um has room for as many values.
 */
HYST_HOST int hyst_host_simulate(const hyst_host_model_t *model, double sample_rate_hz, size_t samples,
                                 const double *drive_v, const char *options, double *position_um);
/**
 * `hyst bode`: of a recording, and of a model (may be NULL) under its drive; without a recording (NULL) of the model
 * for small signals. options: NULL, or, without a recording, "bias_v", "amplitude_v" and "sample_rate_hz". Answers as
 * the command with --json, without "format".
 */
HYST_HOST char *hyst_host_bode(const hyst_host_recording_t *recording, const hyst_host_model_t *model,
                               const char *options);
/**
 * `hyst compile`: the parameter image, *length bytes; NULL on failure. options: NULL, or those of the command as
 * "sample_rate_hz", "drive_range_v": [low, high], "position_range_um", "delay_s", "frequency_hz", "preload_n",
 * "follow": "reading" or "position", "filters" (boolean). report (may be NULL) receives what the command prints with
 * --json.
 */
HYST_HOST unsigned char *hyst_host_compile(const hyst_host_model_t *model, const char *options, size_t *length,
                                           char **report);

/* -------------------------------------------------------------------------------------------------- diagnosis --- */

/** `hyst diagnose`: model may be NULL. The recordings are copied. */
HYST_HOST hyst_host_diagnosis_t *hyst_host_diagnose(const hyst_host_recording_t *const *recordings, size_t count,
                                                    const hyst_host_model_t *model);
/** `hyst diagnose --samples`: at most so many are used; 0: as many as usual. */
HYST_HOST hyst_host_diagnosis_t *hyst_host_diagnose_at_most(const hyst_host_recording_t *const *recordings,
                                                            size_t count, const hyst_host_model_t *model,
                                                            size_t samples);
/** `hyst diagnose --sure`, with the same model; then JSON and text have its counts. each: recordings of each kind, 0:
 * the default. Returns how many they were, 0 on failure. Long work. */
HYST_HOST size_t hyst_host_diagnosis_sure(hyst_host_diagnosis_t *diagnosis, const hyst_host_model_t *model, size_t each,
                                          unsigned long seed);
/** What the command writes with -o. Text and page then say where. */
HYST_HOST int hyst_host_diagnosis_save(hyst_host_diagnosis_t *diagnosis, const char *path);
/** What the command writes with --json, format hyst-diagnosis-1. */
HYST_HOST char *hyst_host_diagnosis_json(const hyst_host_diagnosis_t *diagnosis);
/** What the command prints. */
HYST_HOST char *hyst_host_diagnosis_text(const hyst_host_diagnosis_t *diagnosis);
/** Heading of the page, as with --title; NULL: none. */
HYST_HOST void hyst_host_diagnosis_set_title(hyst_host_diagnosis_t *diagnosis, const char *title);
/** What the command writes with --report. */
HYST_HOST int hyst_host_diagnosis_report(const hyst_host_diagnosis_t *diagnosis, const char *path);
/** The chain with what was found, fitted: what the command writes with -o. */
HYST_HOST hyst_host_model_t *hyst_host_diagnosis_model(const hyst_host_diagnosis_t *diagnosis);
/** Of the recording of this index: the position as the chain says it "before" (given, or the hysteresis alone; fitted)
 * and "after" what was found. NULL: no such column. */
HYST_HOST const double *hyst_host_diagnosis_column(const hyst_host_diagnosis_t *diagnosis, size_t index,
                                                   const char *column);
/** The first sample of that recording that counts: before it, the memory is not determined. */
HYST_HOST size_t hyst_host_diagnosis_from(const hyst_host_diagnosis_t *diagnosis, size_t index);
HYST_HOST void hyst_host_diagnosis_free(hyst_host_diagnosis_t *diagnosis);

/* -------------------------------------------------------------------------------------------------- amplifier --- */

/**
 * Opens the amplifier at a serial port, and keeps others off it. options: "port", which is required, "baud",
 * "parity", "slave", "timeout_s", as the options of the commands. An amplifier whose register map has another version
 * is opened, too, but only stop, park and off work with it; all else fails with the side to upgrade.
 */
HYST_HOST hyst_host_device_t *hyst_host_device_open(const char *options);
/** Closes the port. What the amplifier does then it goes on doing: park it before. */
HYST_HOST void hyst_host_device_close(hyst_host_device_t *device);
/**
 * Requests that what this device does in another thread ends, and the drive parks: it then fails with "interrupted ..".
 * It holds until taken back (0), which is due before the next run. From any thread or signal handler.
 */
HYST_HOST void hyst_host_device_cancel(hyst_host_device_t *device, int cancel);

/**
 * `hyst record`. options: "waveform", "frequency_hz", "amplitude_v", "offset_v", "cycles", "steps", "end_frequency_hz",
 * "sweep_s", "linear", "tones"; or "probe" and "slew_rate_v_per_s"; "drive_range_v": [low, high], "position_range_um",
 * "condition" (boolean). Progress as of long work.
 */
HYST_HOST hyst_host_recording_t *hyst_host_device_record(hyst_host_device_t *device, const char *options);
/**
 * `hyst track`. options: "waveform", "frequency_hz", "amplitude_um", "offset_um", "cycles", "steps",
 * "end_frequency_hz", "sweep_s", "linear", "tones", "frames", "condition", and "mode": "linear", "compensate" or
 * "both". Answers as the command with --json; recording[0], and with both recording[1], receive the recordings, NULL on
 * failure.
 */
HYST_HOST char *hyst_host_device_track(hyst_host_device_t *device, const char *options,
                                       hyst_host_recording_t *recording[2]);
/** Of a record or track that has failed: a recording that was complete before it did, as where the amplifier could not
 * be disarmed after it. index 1: the second of a track in both modes. It is there until the next record or track, and
 * the caller's from then on; NULL: none, or it was taken. */
HYST_HOST hyst_host_recording_t *hyst_host_device_kept(hyst_host_device_t *device, size_t index);
/** Of the newest record, track or stop: the fault that it led the amplifier out of, as the line that the commands note.
 * Once; NULL: none, or it was taken. */
HYST_HOST char *hyst_host_device_left_fault(hyst_host_device_t *device);
/** `hyst push`: `length` bytes of an image. Answers {"model_id":, "hysteresis":, "operators":}. */
HYST_HOST char *hyst_host_device_push(hyst_host_device_t *device, const unsigned char *image, size_t length);
/** `hyst pull`: the image in force, *length bytes; NULL on failure. */
HYST_HOST unsigned char *hyst_host_device_pull(hyst_host_device_t *device, size_t *length);
/** `hyst stop` and `hyst park`. Answers {"mode":, "state":}; both null where the register map has another version, as
 * what becomes of it is not read then. */
HYST_HOST char *hyst_host_device_stop(hyst_host_device_t *device);
HYST_HOST char *hyst_host_device_park(hyst_host_device_t *device);
/** The same, and off there, or in a fault, where the stage is disabled: as `hyst park --off`. Waits for it. */
HYST_HOST char *hyst_host_device_off(hyst_host_device_t *device);
/** Mode and state now, and what the last snapshot says: {"mode":, "state":, "sample":, "time_s":, "reference":,
 * "reference_unit": "V" or "um", "drive_v":, "position_um":}. sample: number of the loop's sample, which wraps at 2^32;
 * time_s: the same in s. */
HYST_HOST char *hyst_host_device_now(hyst_host_device_t *device);
/**
 * Waits until the model is no longer true, as `hyst watch` does, but once. options: "limit_um", "times", "time_s",
 * "before_s", "after_s", as the options of the command; "for_s": at most so long, in the amplifier's time; without it
 * until it warns. Answers {"warned": boolean, "limit_um":, "usual_um":, "seconds":, "warned_s":}: what it waited with
 * and for how long, and the place of the warning in recording[0], which receives what was before and after it. Without
 * a warning warned_s is null and recording[0] NULL. Moves nothing, and ends by hyst_host_device_cancel.
 */
HYST_HOST char *hyst_host_device_watch(hyst_host_device_t *device, const char *options,
                                       hyst_host_recording_t *recording[1]);
/** `hyst info`: answers as the command with --json ("hyst-info-1"). */
HYST_HOST char *hyst_host_device_info(hyst_host_device_t *device);

#endif
