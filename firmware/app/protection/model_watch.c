/* SPDX-License-Identifier: MIT */
#include "protection/model_watch.h"
#include "board.h"

/* Errors are summed in units of 2^-22: half of the difference, which fits 32 bits, shifted by 8 more. So |e| <= 2^23,
 * a block's sum <= 2^33 and its squares <= 2^56. A 16-bit converter's code is 128 units. */
#define SHIFT 8U

typedef struct {
    int64_t sum;
    uint64_t squares;
} sums_t;

static struct {
    sums_t now; /* of the block that goes on */
    uint32_t left;
    uint32_t largest; /* |e| */
    bool live;
    uint64_t limit; /* of a block's squares */
    uint32_t bad, to_warn;
    sums_t whole; /* of the last whole block */
    uint32_t blocks;
} watch;

static void begin_block(void) {
    watch.now = (sums_t){0};
    watch.left = MODEL_WATCH_BLOCK;
}

void model_watch_init(void) {
    begin_block();
    watch.whole = (sums_t){0};
    watch.blocks = 0;
    watch.largest = 0;
    model_watch_set_limit(0, 0);
}

static void end_block(void) {
    watch.whole = watch.now;
    watch.blocks++;
    watch.bad = watch.now.squares > watch.limit ? watch.bad + 1U : 0;
    watch.live = watch.bad >= watch.to_warn;
    if (watch.live) {
        watch.bad = watch.to_warn; /* no overflow */
    }
    begin_block();
}

bool model_watch_sample(hyst_q31_t reference, hyst_q31_t position) {
    const int32_t half = (position >> 1) - (reference >> 1); /* |.| <= 2^31 - 1 */
    const int32_t error = half >> SHIFT;
    const uint32_t size = (uint32_t)(error < 0 ? -error : error);
    watch.now.sum += error;
    watch.now.squares += (uint64_t)size * size;
    if (size > watch.largest) {
        watch.largest = size;
    }
    watch.left--;
    if (watch.left == 0) {
        end_block();
    }
    return watch.live;
}

void model_watch_set_limit(hyst_q31_t limit, uint32_t samples) {
    const uint64_t unit = (uint32_t)(limit > 0 ? limit : 0) >> (SHIFT + 1U);
    watch.limit = limit > 0 ? unit * unit << MODEL_WATCH_BLOCK_BITS : UINT64_MAX;
    watch.to_warn = (samples + MODEL_WATCH_BLOCK - 1U) >> MODEL_WATCH_BLOCK_BITS;
    watch.to_warn = watch.to_warn > 0 ? watch.to_warn : 1U;
    watch.bad = 0;
    watch.live = false;
    begin_block();
}

void model_watch_clear(void) {
    watch.largest = 0;
}

/* The largest integer whose square is not above x <= 2^48. */
static uint32_t root(uint64_t x) {
    uint32_t result = 0;
    for (uint32_t bit = UINT32_C(1) << 24; bit != 0; bit >>= 1) {
        const uint32_t next = result | bit;
        if ((uint64_t)next * next <= x) {
            result = next;
        }
    }
    return result;
}

/* Units to Q31, saturated. */
static hyst_q31_t to_q31(int64_t units) {
    return hyst_saturate(units * (INT64_C(1) << (SHIFT + 1U)));
}

model_error_t model_watch_error(void) {
    const uint32_t key = board_lock();
    const sums_t sums = watch.whole;
    const uint32_t blocks = watch.blocks;
    const uint32_t largest = watch.largest;
    board_unlock(key);
    const int64_t mean = hyst_round_shift(sums.sum, MODEL_WATCH_BLOCK_BITS); /* |.| <= 2^23 */
    const uint64_t mean_square = sums.squares >> MODEL_WATCH_BLOCK_BITS;     /* <= 2^46 */
    const uint64_t square_of_mean = (uint64_t)(mean * mean);
    return (model_error_t){
        .rms = to_q31(root(mean_square)),
        .largest = to_q31(largest),
        .slow = to_q31(mean),
        .fast = to_q31(root(mean_square > square_of_mean ? mean_square - square_of_mean : 0)),
        .blocks = blocks,
    };
}
