/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * An amplifier on a pseudo-terminal: the application on the fake board of tests/firmware, in a process of its own,
 * behind a line that can be made to misbehave. Its communication timeout counts real time. Its actuator follows the
 * drive one to one, unless it is given another.
 */
#ifndef TESTS_SIMULATED_DEVICE_H
#define TESTS_SIMULATED_DEVICE_H

#include "bench/twin.h"
#include <stdbool.h>
#include <stdint.h>

/** What the line does to a request or its answer. */
typedef enum {
    LINE_GOOD,
    LINE_LOSES_REQUEST, /**< not executed, not answered */
    LINE_LOSES_ANSWER,  /**< executed, not answered */
    LINE_DELAYS,        /**< the answer comes delay_ms late */
    LINE_FLIPS_BIT,     /**< one bit in the middle of the answer */
    LINE_CUTS,          /**< the last two bytes are missing */
    LINE_WRONG_SLAVE,   /**< a valid answer by somebody else */
    LINE_NOISE_BEFORE,  /**< bytes that belong to nothing, then the answer */
    LINE_ECHOES,        /**< the request itself, then the answer */
    LINE_BUSY,          /**< a valid exception 6 instead of the answer */
    LINE_LIES,          /**< a valid answer whose last register is one more */
    LINE_HANGS_UP       /**< the device disappears */
} line_fault_t;

/** Shared with the device's process: the test writes the first part, the device the second. */
typedef struct {
    volatile line_fault_t fault;
    volatile unsigned after; /**< requests that pass before the fault begins */
    volatile unsigned times; /**< requests it lasts; 0 ends it */
    volatile unsigned delay_ms;
    volatile bool loop_stands; /**< the sample interrupt does not come */
    /** Of the loop, by the clock; 0: 100, ten times as many as those of a loop at 10 kHz. */
    volatile int samples_per_ms;
    /** 0: the loop runs by the clock; else it makes so many samples while a request and its answer are on the line, and
     * none otherwise: then nothing depends on how busy this machine is. */
    volatile int samples_per_request;
    volatile int position_offset;     /**< of the sensor, in codes: 0, or it has moved */
    volatile unsigned park_after;     /**< requests until somebody parks the amplifier; 0: nobody does */
    volatile unsigned disarm_after;   /**< requests until somebody disarms it; 0: nobody does */
    volatile bool arms_anew;          /**< somebody disarms it and arms it again, at each request */
    volatile unsigned lost_disarms;   /**< so many commands `disarm` are lost, as by LINE_LOSES_REQUEST */
    volatile unsigned restart_after;  /**< requests until it restarts by itself, without an image; 0: it does not */
    volatile bool supply_goes;        /**< and then because the supply was gone: it counts its starts from 1 again */
    volatile bool restart_at_capture; /**< restart_after counts the requests that read the capture */
    volatile uint32_t sequence;       /**< the number of the loop's next sample, once; 0: as it counts */

    volatile unsigned requests;   /**< that arrived */
    volatile unsigned lost;       /**< of these, by LINE_LOSES_REQUEST */
    volatile unsigned starts;     /**< commands `start` that were executed */
    volatile unsigned saves;      /**< commands that store the image */
    volatile int lowest, highest; /**< codes of the drive, since the test set them to 65535 and 0 */
} line_control_t;

/** Starts the device, with a copy of this twin for its actuator, or NULL. Returns its port. */
const char *simulated_device_start(twin_t *actuator);
line_control_t *simulated_device_line(void);

/** The next `times` requests, after `after` good ones, meet the fault. */
void simulated_device_fault(line_fault_t fault, unsigned after, unsigned times);

/** It gets no processor, as on a busy machine, until it is to go on. */
void simulated_device_pause(bool pause);

/** Ends its process, if it runs. */
void simulated_device_stop(void);

#endif
