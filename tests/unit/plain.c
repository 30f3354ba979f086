/* SPDX-License-Identifier: MIT */
#include "plain.h"

static int64_t size(int64_t x) {
    return x < 0 ? -x : x;
}

static int64_t growth_of(const hyst_pi_t *model, const plain_t *plain) {
    const int64_t growth = ((int64_t)model->beta * size(plain->rate) + (1 << 18)) >> 19;
    return growth < model->kappa_limit ? growth : model->kappa_limit;
}

static int64_t play(int64_t r, int64_t v, int64_t w) {
    return w < v - r ? v - r : w > v + r ? v + r : w;
}

void plain_reset(const hyst_pi_t *model, plain_t *plain, int32_t drive) {
    for (uint32_t i = 0; i < model->operators; i++) {
        plain->memory[i] = (int32_t)play(model->threshold[i], drive, 0);
    }
    plain->drive = drive;
    plain->rate = 0;
}

void plain_advance(const hyst_pi_t *model, plain_t *plain, int32_t drive) {
    const int64_t growth = growth_of(model, plain);
    for (uint32_t i = 0; i < model->operators; i++) {
        plain->memory[i] = (int32_t)play(model->threshold[i] + growth, drive, plain->memory[i]);
    }
    if (model->beta > 0) {
        const int64_t step = ((int64_t)drive - plain->drive) >> 1;
        plain->rate = (int32_t)(plain->rate + (((step - plain->rate) * model->rate_gain + (1 << 29)) >> 30));
    }
    plain->drive = drive;
}

static int64_t weight(const hyst_pi_t *model, uint32_t i) {
    return i == 0 ? model->slope[0].value : (int64_t)model->slope[i].value - model->slope[i - 1].value;
}

static int64_t sum(const hyst_pi_t *model, const plain_t *plain) {
    int64_t total = 0;
    for (uint32_t i = 0; i < model->operators; i++) {
        total += weight(model, i + 1) * plain->memory[i];
    }
    return total;
}

int32_t plain_output(const hyst_pi_t *model, const plain_t *plain) {
    const int64_t total = weight(model, 0) * plain->drive + sum(model, plain) + (int64_t)model->offset * (1 << 28);
    return hyst_saturate((total + (1 << 27)) >> 28);
}

/* Walks the corners z_i + outward r_i from the first on, as long as the response there has not reached the target. */
static int64_t walk(const hyst_pi_t *model, const plain_t *plain, int64_t growth, int outward, int64_t rest) {
    int64_t corner = 0;
    int64_t slope = 1;
    int64_t beyond = 0;
    for (uint32_t i = 0; i < model->operators && rest > 0; i++) {
        const int64_t next = plain->memory[i] + outward * (model->threshold[i] + growth);
        const int64_t left = rest - (i > 0 ? model->slope[i].value * size(next - corner) : 0);
        if (left > 0) {
            corner = next;
            slope = model->slope[i + 1].value;
            beyond = left;
        }
        rest = left;
    }
    return corner + outward * ((beyond + slope / 2) / slope);
}

int32_t plain_solve(const hyst_pi_t *model, const plain_t *plain, int32_t position, bool *saturated) {
    const int64_t target = ((int64_t)position - model->offset) * (1 << 28);
    const int64_t memory = sum(model, plain);
    const int64_t growth = growth_of(model, plain);
    int64_t drive = 0;
    bool inside = true;
    for (int outward = -1; outward <= 1 && model->operators > 0; outward += 2) {
        const int64_t first = plain->memory[0] + outward * (model->threshold[0] + growth);
        const int64_t rest = outward * (target - (weight(model, 0) * first + memory));
        if (rest > 0) {
            drive = walk(model, plain, growth, outward, rest);
            inside = false;
        }
    }
    if (inside) {
        const int64_t distance = target - memory;
        drive = (distance + (distance < 0 ? -1 : 1) * (weight(model, 0) / 2)) / weight(model, 0);
    }
    *saturated = *saturated || drive > INT32_MAX || drive < INT32_MIN;
    return hyst_saturate(drive);
}
