/* SPDX-License-Identifier: MIT */
#include "protection/sensor_watch.h"
#include "board.h"
#include "hyst/fixed.h"
#include "loop/telemetry.h"

/* A quarter of the range, 2^30, in units of 2^8. Added up it saturates far beyond. */
#define UNITS      8U
#define FAR_ENOUGH (INT32_C(1) << (30U - UNITS))

static struct {
    uint16_t code;
    uint32_t left;   /* samples in a row with this code that are still to come */
    int32_t moved;   /* of the drive since then */
    uint32_t at_end; /* WARNING_SENSOR if it is the code of an end; once none are left */
} watch;

static void begin_with(uint16_t code) {
    watch.code = code;
    watch.left = SENSOR_WATCH_STILL;
    watch.moved = 0;
}

void sensor_watch_init(void) {
    begin_with(0);
}

static void judge_code(void) {
    const uint32_t last = UINT32_C(0xFFFF0000) >> board_info.position_bits & 0xFFFFU;
    watch.at_end = watch.code == 0 || watch.code == last ? (uint32_t)WARNING_SENSOR : 0U;
}

uint32_t sensor_watch_sample(uint16_t code, uint32_t step) {
    if (code != watch.code) {
        begin_with(code);
        return 0;
    }
    watch.moved = hyst_add(watch.moved, (int32_t)(step >> UNITS));
    if (watch.left > 0) {
        watch.left--;
        if (watch.left == 0) {
            judge_code();
        }
        return 0;
    }
    return watch.moved >= FAR_ENOUGH ? watch.at_end | (uint32_t)WARNING_CONVERTER : watch.at_end;
}
