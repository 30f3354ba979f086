/* SPDX-License-Identifier: MIT */
#include "protection/sensor_watch.h"
#include "board.h"
#include "loop/telemetry.h"

/* A quarter of the range, 2^30, in units of 2^8: added up, it fits 32 bits for 2^24 samples of the largest step. */
#define UNITS       8U
#define FAR_ENOUGH  (UINT32_C(1) << (30U - UNITS))
#define FAR_FURTHER (FAR_ENOUGH << 1U)

static struct {
    uint16_t code;
    uint32_t at_end; /* WARNING_SENSOR if the code is one of an end */
    uint32_t left;   /* samples in a row with this code that are still to come */
    uint32_t moved;  /* of the drive since then, at most FAR_FURTHER and a step */
} watch;

static void begin_with(uint16_t code) {
    const uint32_t last = UINT32_C(0xFFFF0000) >> board_info.position_bits & 0xFFFFU;
    watch.code = code;
    watch.at_end = code == 0 || code == last ? (uint32_t)WARNING_SENSOR : 0U;
    watch.left = SENSOR_WATCH_STILL;
    watch.moved = 0;
}

void sensor_watch_init(void) {
    begin_with(0);
}

uint32_t sensor_watch_sample(uint16_t code, uint32_t step) {
    if (code != watch.code) {
        begin_with(code);
        return 0;
    }
    if (watch.moved < FAR_FURTHER) {
        watch.moved += step >> UNITS;
    }
    if (watch.left > 0) {
        watch.left--;
        return 0;
    }
    return watch.at_end | (watch.moved >= FAR_ENOUGH ? (uint32_t)WARNING_CONVERTER : 0U);
}
