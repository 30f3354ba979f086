/* SPDX-License-Identifier: MIT */
#include "motion/source.h"
#include "hyst/sine.h"
#include <stddef.h>

_Static_assert(SOURCE_TONES_MAX <= 16U, "a sixteenth of each product: chord");

hyst_q31_t source_approach(hyst_q31_t value, hyst_q31_t target, hyst_q31_t step) {
    const int64_t distance = (int64_t)target - value;
    if (distance > step) {
        return value + step;
    }
    return distance < -(int64_t)step ? value - step : target;
}

static bool tones_valid(const source_settings_t *settings) {
    const uint64_t most = 2U * HYST_PHASE_QUARTER_TURN;
    if (settings->tone_count < 1 || settings->tone_count > SOURCE_TONES_MAX || settings->increment < 1) {
        return false;
    }
    for (uint32_t i = 0; i < settings->tone_count; i++) {
        const uint32_t harmonic = settings->tones[i].harmonic;
        if (harmonic < 1 || (uint64_t)harmonic * settings->increment > most) {
            return false;
        }
    }
    return true;
}

bool source_settings_valid(const source_settings_t *settings) {
    switch (settings->kind) {
    case SOURCE_HOLD:
        return true;
    case SOURCE_SINE:
        return settings->increment > 0 && settings->increment <= 2U * HYST_PHASE_QUARTER_TURN;
    case SOURCE_BREAKPOINTS:
        return settings->point_count > 0;
    case SOURCE_SWEEP:
        return settings->sweep.samples > 0;
    case SOURCE_MULTISINE:
        return tones_valid(settings);
    }
    return false;
}

void source_reset(source_t *source, hyst_q31_t value, hyst_q31_t slew) {
    *source = (source_t){.value = value, .setpoint = value, .slew = slew};
}

/* The line from `value` to the present point. */
static void begin_line(source_t *source, hyst_q31_t value) {
    const source_point_t point = source->settings.points[source->point];
    const uint32_t samples = point.samples > 0 ? point.samples : 1U;
    /* The distance is below 2^32: one division of 32 bits. */
    const bool falls = point.value < value;
    const uint32_t distance = falls ? (uint32_t)value - (uint32_t)point.value : (uint32_t)point.value - (uint32_t)value;
    uint32_t quotient = distance / samples;
    uint32_t remainder = distance - quotient * samples;
    if (falls) { /* one more than -quotient is too far down, and the remainder leads back */
        quotient = ~quotient;
        remainder = samples - remainder;
    }
    source->line = (source_line_t){.left = samples,
                                   .samples = samples,
                                   .quotient = quotient,
                                   .remainder = remainder,
                                   .lacking = samples - samples / 2U}; /* half: rounds to nearest */
}

void source_start(source_t *source, const source_settings_t *settings) {
    source->settings = *settings;
    source->playing = settings->kind != SOURCE_HOLD;
    source->cycles = 0;
    source->point = 0;
    source->setpoint = source->value;
    if (settings->kind == SOURCE_SINE || settings->kind == SOURCE_MULTISINE) {
        source->phase = 0U - settings->increment; /* one step before 0, where the first turn begins */
        source->cycles = UINT32_MAX;
    } else if (settings->kind == SOURCE_SWEEP) {
        sweep_begin(&settings->sweep, &source->sweep);
    } else if (settings->kind == SOURCE_BREAKPOINTS) {
        begin_line(source, source->value);
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

/* offset + amplitude * shape. */
static hyst_q31_t scaled(const source_settings_t *s, hyst_q31_t shape) {
    const int64_t swing = hyst_round_shift(hyst_product(s->amplitude, shape), 31); /* <= 2^31 */
    if (s->amplitude == HYST_Q31_MIN) { /* 2^31 alone does not fit, which -2^31 times -2^31 makes */
        return hyst_saturate(s->offset + swing);
    }
    return hyst_add(s->offset, (int32_t)swing);
}

static hyst_q31_t play_sine(source_t *source) {
    const source_settings_t *s = &source->settings;
    source->phase += s->increment;
    const bool turned = source->phase < s->increment;
    if (turned && last_cycle(source)) {
        source->playing = false;
        return s->offset;
    }
    return scaled(s, hyst_sine(source->phase));
}

static hyst_q31_t play_sweep(source_t *source) {
    const source_settings_t *s = &source->settings;
    uint32_t phase;
    if (!sweep_next(&s->sweep, &source->sweep, &phase)) {
        if (last_cycle(source)) {
            source->playing = false;
            return s->offset;
        }
        (void)sweep_next(&s->sweep, &source->sweep, &phase); /* the first of the next pass */
    }
    return scaled(s, hyst_sine(phase));
}

/* The sum of the tones at this phase: products of 2^62 or less, a sixteenth of each. */
static hyst_q31_t chord(const source_settings_t *s, uint32_t phase) {
    int64_t sum = 0;
    for (uint32_t i = 0; i < s->tone_count; i++) {
        const source_tone_t *tone = &s->tones[i];
        sum += hyst_product(tone->amplitude, hyst_sine(tone->harmonic * phase + tone->phase)) >> 4;
    }
    return hyst_saturate(hyst_round_shift(sum, 27));
}

static hyst_q31_t play_multisine(source_t *source) {
    const source_settings_t *s = &source->settings;
    source->phase += s->increment;
    const bool turned = source->phase < s->increment;
    if (turned && last_cycle(source)) {
        source->playing = false;
        return scaled(s, chord(s, 0));
    }
    return scaled(s, chord(s, source->phase));
}

/* At the end of a line. */
static void next_line(source_t *source, hyst_q31_t value) {
    uint32_t point = source->point + 1U;
    if (point == source->settings.point_count) {
        point = 0;
        source->playing = !last_cycle(source);
    }
    source->point = point;
    if (source->playing) {
        begin_line(source, value);
    }
}

static hyst_q31_t play_line(source_t *source) {
    source_line_t *line = &source->line;
    const uint32_t lacking = line->lacking;
    const uint32_t remainder = line->remainder;
    uint32_t value = (uint32_t)source->value + line->quotient; /* between two Q31 values */
    line->lacking = lacking - remainder;
    if (remainder >= lacking) {
        line->lacking += line->samples;
        value++;
    }
    line->left--;
    if (line->left == 0) {
        next_line(source, (hyst_q31_t)value);
    }
    return (hyst_q31_t)value;
}

/* Not inlined: the others are cheaper without it. */
__attribute__((noinline)) static hyst_q31_t play_many_sines(source_t *source) {
    return source->settings.kind == SOURCE_SWEEP ? play_sweep(source) : play_multisine(source);
}

static hyst_q31_t play(source_t *source) {
    const source_kind_t kind = source->settings.kind;
    if (kind == SOURCE_SINE) {
        return play_sine(source);
    }
    return kind == SOURCE_BREAKPOINTS ? play_line(source) : play_many_sines(source);
}

hyst_q31_t source_step(source_t *source) {
    if (!source->playing) {
        source->value = source_approach(source->value, source->setpoint, source->slew);
        return source->value;
    }
    const hyst_q31_t value = play(source);
    source->value = source->setpoint = value;
    return value;
}
