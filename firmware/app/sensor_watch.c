/* SPDX-License-Identifier: MIT */
#include "sensor_watch.h"
#include "board.h"
#include "telemetry.h"

/* A quarter of the range, 2^30, in units of 2^8: added up, it fits 32 bits for 2^24 samples of the largest step. */
#define UNITS       8U
#define FAR_ENOUGH  (UINT32_C(1) << (30U - UNITS))
#define FAR_FURTHER (FAR_ENOUGH << 1U)

static struct {
    uint16_t code;
    uint32_t still; /* samples in a row with this code, at most SENSOR_WATCH_STILL */
    uint32_t moved; /* of the drive since then, at most FAR_FURTHER and a step */
} watch;

void sensor_watch_init(void) {
    watch.code = 0;
    watch.still = watch.moved = 0;
}

uint32_t sensor_watch_sample(uint16_t code, uint32_t step) {
    if (code != watch.code) {
        watch.code = code;
        watch.still = watch.moved = 0;
        return 0;
    }
    if (watch.moved < FAR_FURTHER) {
        watch.moved += step >> UNITS;
    }
    if (watch.still < SENSOR_WATCH_STILL) {
        watch.still++;
        return 0;
    }
    const uint32_t last = UINT32_C(0xFFFF0000) >> board_info.position_bits & 0xFFFFU;
    return (code == 0 || code == last ? (uint32_t)WARNING_SENSOR : 0U) |
           (watch.moved >= FAR_ENOUGH ? (uint32_t)WARNING_CONVERTER : 0U);
}
