/* SPDX-License-Identifier: MIT */
#include "source.h"
#include "hyst/sine.h"
#include <stddef.h>

hyst_q31_t source_approach(hyst_q31_t value, hyst_q31_t target, hyst_q31_t step) {
    const int64_t distance = (int64_t)target - value;
    if (distance > step) {
        return value + step;
    }
    return distance < -(int64_t)step ? value - step : target;
}

bool source_settings_valid(const source_settings_t *settings) {
    switch (settings->kind) {
    case SOURCE_HOLD:
        return true;
    case SOURCE_SINE:
        return settings->increment > 0 && settings->increment <= 2U * HYST_PHASE_QUARTER_TURN;
    case SOURCE_BREAKPOINTS:
        return settings->point_count > 0;
    }
    return false;
}

void source_reset(source_t *source, hyst_q31_t value, hyst_q31_t slew) {
    *source = (source_t){.value = value, .setpoint = value, .slew = slew};
}

/* Sets up the line from the present value to the present point. */
static void begin_line(source_t *source) {
    const source_point_t point = source->settings.points[source->point];
    const uint32_t samples = point.samples > 0 ? point.samples : 1U;
    /* The distance is below 2^32: one division of 32 bits. */
    const bool falls = point.value < source->value;
    const uint32_t distance =
        falls ? (uint32_t)source->value - (uint32_t)point.value : (uint32_t)point.value - (uint32_t)source->value;
    int64_t quotient = distance / samples;
    uint32_t remainder = distance - (uint32_t)quotient * samples;
    if (falls) { /* rounded down: away from zero */
        quotient = -quotient - (remainder > 0 ? 1 : 0);
        remainder = remainder > 0 ? samples - remainder : 0;
    }
    source->line = (source_line_t){.left = samples,
                                   .samples = samples,
                                   .quotient = quotient,
                                   .remainder = remainder,
                                   .fraction = samples / 2U}; /* half: rounds to nearest */
}

void source_start(source_t *source, const source_settings_t *settings) {
    source->settings = *settings;
    source->playing = settings->kind != SOURCE_HOLD;
    source->cycles = 0;
    source->point = 0;
    source->setpoint = source->value;
    if (settings->kind == SOURCE_SINE) {
        source->phase = 0U - settings->increment; /* one step before 0, where the first turn begins */
        source->cycles = UINT32_MAX;
    } else if (settings->kind == SOURCE_BREAKPOINTS) {
        begin_line(source);
    }
}

void source_stop(source_t *source) {
    source->playing = false;
    source->setpoint = source->value;
}

/* Counts a complete turn or pass. Returns whether it was the last one. */
static bool last_cycle(source_t *source) {
    source->cycles++; /* wraps after 2^32 turns only when it plays without end */
    return source->settings.cycles != 0 && source->cycles == source->settings.cycles;
}

static hyst_q31_t play_sine(source_t *source) {
    const source_settings_t *s = &source->settings;
    source->phase += s->increment;
    const bool turned = source->phase < s->increment;
    if (turned && last_cycle(source)) {
        source->playing = false;
        return s->offset;
    }
    const int64_t swing = hyst_round_shift(hyst_product(s->amplitude, hyst_sine(source->phase)), 31); /* <= 2^31 */
    const int32_t near = (int32_t)swing;
    return near == swing ? hyst_add(s->offset, near) : hyst_saturate(s->offset + swing); /* 2^31 alone does not fit */
}

static hyst_q31_t play_line(source_t *source) {
    source_line_t *line = &source->line;
    line->fraction += line->remainder;
    int64_t value = source->value + line->quotient;
    if (line->fraction >= line->samples) {
        line->fraction -= line->samples;
        value++;
    }
    source->value = (hyst_q31_t)value; /* between two Q31 values */
    line->left--;
    if (line->left == 0) {
        source->point++;
        if (source->point == source->settings.point_count) {
            source->point = 0;
            source->playing = !last_cycle(source);
        }
        if (source->playing) {
            begin_line(source);
        }
    }
    return source->value;
}

hyst_q31_t source_step(source_t *source) {
    if (source->playing) {
        source->value = source->settings.kind == SOURCE_SINE ? play_sine(source) : play_line(source);
        source->setpoint = source->value;
    } else {
        source->value = source_approach(source->value, source->setpoint, source->slew);
    }
    return source->value;
}
