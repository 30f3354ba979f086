/* SPDX-License-Identifier: MIT */
/**
 * One sample's values, handed from the sample interrupt to the main loop as a whole.
 *
 * The names are those of the registers. Counters saturate, except the sequence number, which wraps.
 */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include "hyst/compensator.h"

/** Register `state`. */
typedef enum { LOOP_IDLE = 0, LOOP_PLAYING = 1, LOOP_CONDITIONING = 2, LOOP_PARKED = 3 } loop_state_t;

/** Register `amplifier_state`. */
typedef enum {
    AMPLIFIER_OFF = 0,
    AMPLIFIER_PRECHARGE = 1,
    AMPLIFIER_CONDITIONING = 2,
    AMPLIFIER_HOLD = 3,
    AMPLIFIER_RUN = 4,
    AMPLIFIER_STOP = 5,
    AMPLIFIER_FAULT = 6
} amplifier_state_t;

/** Bits of the registers `limits_live` and `limits_sticky`: in force, and no fault. Append only. */
enum {
    LIMIT_DRIVE = 1,       /**< the drive met an end of its range */
    LIMIT_UNREACHABLE = 2, /**< no drive reaches the reference */
    LIMIT_FILTER = 4,      /**< a filter saturated */
    LIMIT_SLEW = 8,        /**< the drive moves as fast as the board allows */
    LIMIT_MEMORY = 16,     /**< the model's memory was lost: condition the actuator */
    LIMIT_REFERENCE = 32,  /**< the reference is not what its source asks for (reference_limit.h) */
    LIMIT_SETS = 64        /**< sets of them */
};

/** Bits of the registers `warnings_live` and `warnings_sticky`: nothing stops. Append only. */
enum {
    WARNING_MODEL = 1,      /**< the model is no longer true (model_watch.h) */
    WARNING_SENSOR = 2,     /**< the reading is at an end of the converter (sensor_watch.h) */
    WARNING_CONVERTER = 4,  /**< the reading stands still while the drive moves (sensor_watch.h) */
    WARNING_TEMPERATURE = 8 /**< too hot, or the sensor of that is lost (health_watch.h) */
};

/* The type of a field, by the type of its register; ENUM is one of the enumerations above and in hyst/compensator.h. */
#define TELEMETRY_U16  uint32_t
#define TELEMETRY_U32  uint32_t
#define TELEMETRY_ENUM uint32_t
#define TELEMETRY_BITS uint32_t
#define TELEMETRY_Q31  hyst_q31_t

/** One field a row TELEMETRY or COUNTER of registers.def. Reference, drive and position are aligned (loop.h).
 */
typedef struct {
#define TELEMETRY(name, address, type, unit, text) TELEMETRY_##type name;
#include "registers/registers.def"
} telemetry_t;

/** Samples since start or clear, by the set of limits that were in force (LIMIT_ bits): a sample counts one number, and
 * who reads adds them up. */
typedef struct {
    uint32_t samples[LIMIT_SETS]; /**< saturate */
} limit_counts_t;

/** Where the sample and the counts are, which stay there and are read there. From then on only the sample interrupt may
 * write to them (or the main loop, under board_lock), and each sample has another sequence number. */
void telemetry_publish(const telemetry_t *sample, const limit_counts_t *limits);

/** Main loop only: the newest sample. Filled in here are how far a capture is (capture.h), and what the counts of
 * limits say: samples, limits_sticky and the limits' counters. */
void telemetry_read(telemetry_t *sample);

#endif
