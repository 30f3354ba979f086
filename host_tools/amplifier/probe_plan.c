/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/probe_plan.h"
#include "chain/catalogue.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Half a period takes at least so many frames besides its flat end, so that a recording shows more than its ends. */
#define HALF_PERIOD_FRAMES 5.0

static const double start_level = 0.5;
static const double chirp_from_hz = 1.0, chirp_to_hz = 150.0, burst_hz = 40.0;

/* A plan that is being written. Levels are fractions of the range. */
typedef struct {
    probe_plan_t *plan;
    double frame_s, steepest; /* steepest line, in ranges per second */
    double level;             /* where the last line ended */
} pen_t;

static double volts(const pen_t *pen, double level) {
    const double *range = pen->plan->limits.range_v;
    return range[0] + level * (range[1] - range[0]);
}

/* A corner that is not there would be a jump: no plan has that many, which the test shows. */
static void corner(pen_t *pen, double samples, double level) {
    probe_plan_t *plan = pen->plan;
    if (plan->corners < PROBE_PLAN_MAX_CORNERS) {
        plan->corner[plan->corners++] = (breakpoint_t){(uint32_t)samples, volts(pen, level)};
        plan->samples += samples;
        pen->level = level;
    }
}

/* Takes a whole number of frames near to `seconds`, or as many as it takes not to be too steep. */
static void line(pen_t *pen, double level, double seconds) {
    const double wanted = floor(seconds / pen->frame_s + 0.5);
    const double needed = ceil(fabs(level - pen->level) / (pen->steepest * pen->frame_s) - 1e-6);
    corner(pen, fmax(fmax(wanted, needed), 1.0) * (double)pen->plan->limits.decimation, level);
}

static double now_s(const pen_t *pen) {
    return pen->plan->samples / pen->plan->limits.sample_rate_hz;
}

/* To the end of a triangle, which is flat for one frame. Otherwise a delay or a lag would let the extreme fall between
 * two frames, and a simulation at the rate of the recording would give the hysteresis a memory of less than there was.
 */
static void line_to_end(pen_t *pen, double level, double seconds) {
    line(pen, level, seconds - pen->frame_s);
    line(pen, level, pen->frame_s);
}

static void step(pen_t *pen, double level) {
    if (level != pen->level) {
        line(pen, level, 0.0);
    }
}

static void hold(pen_t *pen, double level, double seconds) {
    step(pen, level);
    line(pen, level, seconds);
}

/* The fastest triangle of this width that the limits allow, or `hz` if that is slower. */
static double fastest_hz(const pen_t *pen, double width, double hz) {
    const double rise_s = fmax(width / pen->steepest, HALF_PERIOD_FRAMES * pen->frame_s);
    return fmin(hz, 0.5 / (rise_s + pen->frame_s));
}

static void sweep(pen_t *pen) {
    line(pen, 1.0, 0.25);
    line(pen, 0.0, 0.5);
    line(pen, start_level, 0.25);
}

static void decaying_triangle(pen_t *pen, double seconds) {
    enum { HALF_PERIODS = 9 };
    for (int i = 0; i < HALF_PERIODS; i++) {
        const double swing = 0.5 * (1.0 - (double)i / HALF_PERIODS);
        line_to_end(pen, i % 2 == 0 ? 0.5 + swing : 0.5 - swing, seconds / HALF_PERIODS);
    }
    step(pen, 0.5);
}

static void slow_triangle(pen_t *pen) {
    decaying_triangle(pen, 2.0);
}

static void fast_triangle(pen_t *pen) {
    decaying_triangle(pen, 0.5);
}

static void silence(pen_t *pen) {
    hold(pen, 0.5, 1.0);
    hold(pen, 0.05, 1.0);
}

static void staircase(pen_t *pen) {
    static const double stair[] = {0.2, 0.55, 0.9, 0.55, 0.2, 0.0, 0.5};
    for (size_t i = 0; i < sizeof stair / sizeof stair[0]; i++) {
        hold(pen, stair[i], 1.5);
    }
}

/*
 * Frequency rising evenly in its logarithm: f(t) = a exp(k t) with k = ln(b / a) / T, that is a / k (exp(k t) - 1)
 * turns at t. The ends of a triangle are where the turns are 1/4, 3/4 ..
 */
static void chirp(pen_t *pen, double width, double seconds) {
    const double to_hz = fastest_hz(pen, width, chirp_to_hz), from_hz = fmin(chirp_from_hz, 0.5 * to_hz);
    const double k = log(to_hz / from_hz) / seconds;
    step(pen, 0.5);
    const double begin_s = now_s(pen);
    double end_s = 0.0;
    for (int i = 0; end_s < seconds; i++) {
        end_s = log(1.0 + (0.25 + 0.5 * i) * k / from_hz) / k;
        line_to_end(pen, 0.5 + (i % 2 == 0 ? 0.5 : -0.5) * width, begin_s + end_s - now_s(pen));
    }
    step(pen, 0.5);
}

static void chirps(pen_t *pen) {
    chirp(pen, 0.05, 1.5);
    chirp(pen, 0.3, 1.5);
}

/* `count` triangles about a level. */
static void triangles(pen_t *pen, double middle, double width, double period_s, int count) {
    step(pen, middle);
    for (int i = 0; i < count; i++) {
        line_to_end(pen, middle + 0.5 * width, (i == 0 ? 0.25 : 0.5) * period_s);
        line_to_end(pen, middle - 0.5 * width, 0.5 * period_s);
    }
    line(pen, middle, 0.25 * period_s);
}

static void burst(pen_t *pen) {
    const double hz = fastest_hz(pen, 0.6, burst_hz);
    triangles(pen, 0.5, 0.6, 1.0 / hz, (int)fmax(1.0, hz));
    hold(pen, 0.5, 1.5);
}

static void ladder(pen_t *pen) {
    for (int width_percent = 80; width_percent <= 100; width_percent += 5) {
        triangles(pen, 0.5, 0.01 * width_percent, 0.2, 1);
    }
}

static void loops(pen_t *pen) {
    for (int middle_percent = 10; middle_percent <= 90; middle_percent += 20) {
        triangles(pen, 0.01 * middle_percent, 0.1, 0.06, 3);
    }
    step(pen, 0.5);
}

/* In the order in which they are played. `bit` 0: always. */
static const struct {
    unsigned bit;
    const char *name;
    void (*draw)(pen_t *pen);
} all_parts[] = {{0, "sweep", sweep},
                 {0, "slow triangle", slow_triangle},
                 {PROBE_SILENCE, "silence", silence},
                 {PROBE_STAIRCASE, "staircase", staircase},
                 {PROBE_FAST_TRIANGLE, "fast triangle", fast_triangle},
                 {PROBE_CHIRPS, "chirps", chirps},
                 {PROBE_BURST, "burst", burst},
                 {PROBE_LADDER, "ladder", ladder},
                 {PROBE_LOOPS, "loops", loops},
                 {PROBE_RETURN, "return", slow_triangle}};

static bool played(size_t part, unsigned parts) {
    return all_parts[part].bit == 0 || (all_parts[part].bit & parts) != 0;
}

/* "all", and the blocks that can be probed. */
static void list_names(char *text, size_t size) {
    (void)snprintf(text, size, "all");
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->probe != NULL) {
            const size_t length = strlen(text);
            (void)snprintf(text + length, size - length, ", %s", catalogue[i]->name);
        }
    }
}

unsigned probe_parts(const char *name, failure_t *failure) {
    if (strcmp(name, "all") == 0) {
        return PROBE_EVERYTHING;
    }
    const block_t *block = catalogue_find(name);
    if (block != NULL && block->probe != NULL) {
        return block->probe->parts;
    }
    char names[800];
    list_names(names, sizeof names);
    (void)fail(failure, "%s: %s; there are %s", name,
               block != NULL ? "diagnose does not look for this block" : "no such block", names);
    return 0;
}

void probe_plan_make(probe_plan_t *plan, unsigned parts, const probe_limits_t *limits) {
    *plan = (probe_plan_t){.parts = parts, .limits = *limits};
    pen_t pen = {.plan = plan,
                 .level = start_level,
                 .frame_s = (double)limits->decimation / limits->sample_rate_hz,
                 .steepest = limits->slew_v_per_s / (limits->range_v[1] - limits->range_v[0])};
    plan->start_v = volts(&pen, start_level);
    corner(&pen, (double)limits->lead + 1.0, start_level);
    for (size_t i = 0; i < sizeof all_parts / sizeof all_parts[0]; i++) {
        if (played(i, parts)) {
            all_parts[i].draw(&pen);
        }
    }
}

void probe_plan_describe(const probe_plan_t *plan, char *text, size_t size) {
    size_t length = 0;
    text[0] = '\0';
    for (size_t i = 0; i < sizeof all_parts / sizeof all_parts[0]; i++) {
        if (played(i, plan->parts) && length < size) {
            length += (size_t)snprintf(text + length, size - length, "%s%s", i > 0 ? ", " : "", all_parts[i].name);
        }
    }
}
