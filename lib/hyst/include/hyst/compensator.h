/* SPDX-License-Identifier: MIT */
/**
 * The per-sample pipeline from reference to drive: the signal chain inverted, right to left.
 *
 *     reference -> reference curve -> shape (IIR: inverse of mechanics and sensor) -> inverse creep ->
 *     inverse hysteresis -> inverse drive curve -> + inertia -> equalise (IIR: inverse of the electronics) ->
 *     transition offset -> limits -> drive
 *
 * The reference is a position. With a reference curve it is a reading of the sensor, and the curve holds the position
 * that is read so. The drive curve stands in front of the hysteresis' operators (asymmetry). Inertia is the share of
 * the drive that moves the mass and the damper, a filter of the same position that the hysteresis gets (docs/MODELS.md,
 * section 11).
 *
 * Modes
 *   park        the drive is the parking drive; the reference is ignored
 *   direct      the reference is a drive
 *   linear      drive = linear_offset + linear_gain * reference: what an amplifier without a model would do
 *   compensate  the whole pipeline
 *
 * In every mode the memory of hysteresis and creep is advanced with the drive that leaves this function (with inertia
 * or equalise sections: with what was there before them, plus the transition offset. The rest is spent on the mass and
 * the electronics). So the model stays in step with the actuator.
 *
 * A change of mode or of parameters does not step the drive: the drive repeats its last value for that sample, and the
 * difference becomes an offset that shrinks by transition_slew per sample. While it is not zero, the output is not the
 * model's. (New limits do act at once.)
 *
 * All signals Q31. Cost: docs/TIMING.md. Cannot fail: parameters were validated when they were built.
 * May be called from: the sample interrupt (step, adopt), host. The state belongs to that one context.
 */
#ifndef HYST_COMPENSATOR_H
#define HYST_COMPENSATOR_H

#include "hyst/creep.h"
#include "hyst/curve.h"
#include "hyst/hysteresis.h"
#include "hyst/iir.h"

/** Values are part of the Modbus interface: append only. */
typedef enum { HYST_MODE_PARK = 0, HYST_MODE_DIRECT = 1, HYST_MODE_LINEAR = 2, HYST_MODE_COMPENSATE = 3 } hyst_mode_t;

/** The optional stages of the pipeline, as bits: a sample passes over the others in one step. */
enum {
    HYST_STAGE_REFERENCE_CURVE = 1,
    HYST_STAGE_SHAPE = 2,
    HYST_STAGE_CREEP = 4,
    HYST_STAGE_DRIVE_CURVE = 8,
    HYST_STAGE_INERTIA = 16,
    HYST_STAGE_EQUALISE = 32,
    HYST_STAGE_OTHER_FAMILY = 64, /**< the hysteresis is another than play operators */
    HYST_STAGE_LINE = 128         /**< there is no hysteresis: play operators, and none of them (hyst_pi_is_line) */
};

/** Coefficients, built from a validated parameter image (parameters.h) and constant afterwards. */
typedef struct {
    /* What is small comes first, here and in the state: it is then within the reach of one load. */
    unsigned stages;       /**< HYST_STAGE_ bits of those that there are, written by hyst_compensator_prepare */
    unsigned cascades;     /**< how many sections each has, a byte each; by the same */
    bool curved;           /**< the hysteresis sees drive_curve(drive) */
    bool reference_curved; /**< the position is reference_curve(reference) */
    hyst_q31_t drive_low, drive_high; /**< limits of the drive, low < high */
    hyst_q31_t drive_park;            /**< within the limits */
    hyst_q31_t linear_offset;
    hyst_q28_t linear_gain;
    hyst_q31_t transition_slew; /**< > 0, per sample */
    hyst_iir_t shape;
    hyst_iir_t inertia;
    hyst_iir_t equalise;
    hyst_creep_t creep;
    hyst_curve_t drive_curve;
    hyst_curve_inverse_t drive_curve_inverse; /**< written by hyst_compensator_prepare */
    hyst_curve_t reference_curve;
    hyst_hysteresis_t hysteresis;
} hyst_compensator_t;

/** An offset of the drive. A step across the whole range needs 33 bits: a size, and which way. */
typedef struct {
    uint32_t size; /**< in units of 2^-31 */
    bool falls;    /**< it is taken from the drive */
} hyst_transition_t;

static inline int64_t hyst_transition_value(hyst_transition_t transition) {
    return transition.falls ? -(int64_t)transition.size : (int64_t)transition.size;
}

typedef struct {
    hyst_mode_t mode; /**< of the previous sample */
    bool adopted;     /**< parameters changed since the last sample */
    bool settled;     /**< the filters' state belongs to the present cascade and input */
    bool continues;   /**< the previous sample compensated, with these parameters: settled, of its mode, none adopted */
    hyst_q31_t drive; /**< last drive */
    unsigned events;  /**< HYST_STEP_ bits of the last step */
    hyst_transition_t transition; /**< what remains of one */
    uint32_t memory_in_use;
    uint32_t carried; /**< how far an adoption that is under way has come, else 0 */
    hyst_iir_state_t shape;
    hyst_iir_state_t inertia;
    hyst_iir_state_t equalise;
    hyst_creep_state_t creep;
    hyst_hysteresis_state_t memory[2]; /**< of the hysteresis: one in use, see hyst_compensator_memory, the other where
                                          hyst_compensator_adopt carries it to */
} hyst_compensator_state_t;

/** What happened in one step; bits are part of the Modbus interface. */
enum {
    HYST_STEP_DRIVE_LIMITED = 1,   /**< the drive met drive_low or drive_high */
    HYST_STEP_UNREACHABLE = 2,     /**< no drive reaches the reference */
    HYST_STEP_FILTER_SATURATED = 4 /**< a shape or equalise section saturated */
};

/** Works out what steps look up, from all other coefficients. Whoever writes these has to call it:
 * hyst_parameters_build does. Not per sample. */
void hyst_compensator_prepare(hyst_compensator_t *compensator);

/** Parked at drive_park, demagnetised memory, settled filters. */
void hyst_compensator_reset(const hyst_compensator_t *compensator, hyst_compensator_state_t *state);

/**
 * One sample. `reference` is a position or a reading (linear, compensate) or a drive (direct). Returns the drive,
 * within the limits of this one sample, low <= high. *events receives the HYST_STEP_ bits of this sample (overwritten).
 */
hyst_q31_t hyst_compensator_step_within(const hyst_compensator_t *compensator, hyst_compensator_state_t *state,
                                        hyst_mode_t mode, hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high,
                                        unsigned *events);

/** The same within the compensator's limits. */
static inline hyst_q31_t hyst_compensator_step(const hyst_compensator_t *compensator, hyst_compensator_state_t *state,
                                               hyst_mode_t mode, hyst_q31_t reference, unsigned *events) {
    return hyst_compensator_step_within(compensator, state, mode, reference, compensator->drive_low,
                                        compensator->drive_high, events);
}

/** Memory of the hysteresis, the one in use. */
static inline hyst_hysteresis_state_t *hyst_compensator_memory(hyst_compensator_state_t *state) {
    return &state->memory[state->memory_in_use];
}

/** Where creep and hysteresis have the actuator, by their memory as it is. Not per sample; an interrupt of the caller
 * by a step makes the result useless and does nothing else. */
hyst_q31_t hyst_compensator_position(const hyst_compensator_t *compensator, const hyst_compensator_state_t *state);

/**
 * The reference with which a mode that begins now moves nothing: at rest it makes this drive (direct, linear), or keeps
 * the model at this position (compensate; then creep moves the drive on). The nearest one where full scale, or the
 * limits of a filter, have none. Filters are taken to be settled, and those behind the hysteresis to have the gain 1
 * then. Not per sample.
 */
hyst_q31_t hyst_compensator_rest(const hyst_compensator_t *compensator, hyst_mode_t mode, hyst_q31_t drive,
                                 hyst_q31_t position);

/**
 * `to` replaces `from`. Call between two steps, before every step until the answer is true; until then go on stepping
 * with `from`, from then on with `to`. A call takes over a bounded portion (hyst_hysteresis_carry), so that a sample's
 * cost is bounded too (docs/TIMING.md); the first one answers true unless the memory holds more than a portion. The
 * result does not depend on how many it took: it is that of an adoption in one piece after the last step.
 *
 * The memory of the hysteresis is carried over. Filter state is kept with equally many sections in each cascade and
 * without reference curves (another curve is another input), creep with equally many cells and the same family; else
 * they start settled. The next step turns the jump of the drive into a transition.
 */
bool hyst_compensator_adopt(const hyst_compensator_t *from, const hyst_compensator_t *to,
                            hyst_compensator_state_t *state);

#endif
