/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "look/look_text.h"
#include "base/quantity.h"
#include "base/shown_name.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Of a range without a known error: a thousandth of it. */
static const double shown_part = 1e-3;

static void print_value(FILE *file, const char *name, const char *unit, double value, double sigma) {
    char text[QUANTITY_TEXT];
    quantity_text(text, name, unit, value, sigma);
    fputs(text, file);
}

static void print_rounded(FILE *file, const char *unit, double value, int digits) {
    char text[QUANTITY_TEXT];
    quantity_named(text, "", unit, value, digits);
    fputs(text, file);
}

static void print_range(FILE *file, double from, double to, double resolution) {
    char text[QUANTITY_TEXT];
    quantity_range(text, from, to, resolution);
    fputs(text, file);
}

static void print_time(FILE *file, const recording_t *recording, double time_s) {
    char text[QUANTITY_TEXT];
    quantity_time(text, time_s, 1.0 / recording->sample_rate_hz);
    fputs(text, file);
}

static void print_drive(FILE *file, const look_t *look) {
    static const char *const between[] = {
        "What it does between samples does not show: header key drive_between_samples (held, line, smooth) says it.",
        "held between samples", "a straight line between samples", "so smooth that between samples nothing matters"};
    const drive_look_t *d = &look->drive;
    const double rate_hz = look->recording->sample_rate_hz;
    fprintf(file, "  drive      %s, ", drive_kind_text(d->kind));
    print_range(file, d->range_v[0], d->range_v[1], shown_part * (d->range_v[1] - d->range_v[0]));
    fprintf(file, " V");
    if (d->period > 0.0) {
        fprintf(file, "; %zu passes of %.6g s (%.4g Hz), ", drive_periods(d), d->period / rate_hz, rate_hz / d->period);
        print_range(file, recording_time(look->recording, (double)d->repeat.from),
                    recording_time(look->recording, (double)d->repeat.to),
                    shown_part * (double)look->recording->samples / rate_hz);
        fprintf(file, " s");
    } else if (d->kind != DRIVE_RESTS) {
        fprintf(file, "; most of it at ");
        print_range(file, d->frequency_hz[0], d->frequency_hz[1], 0.0);
        fprintf(file, " Hz");
    }
    if (d->rests > 0) {
        fprintf(file, "; %zu rest%s of %.3g s together", d->rests, d->rests == 1 ? "" : "s", d->rest_s);
    }
    if (d->steps > 0) {
        fprintf(file, "; %zu step%s", d->steps, d->steps == 1 ? "" : "s");
    }
    if (d->noise_v > 0.0) {
        const char *const what = look->prediction.fed_back ? "answers the readings" : "measured";
        fprintf(file, "; %s, with noise of %.2g V", what, d->noise_v);
    }
    if (d->held_samples > 1) {
        fprintf(file, "; a new value every %zu samples", d->held_samples);
    }
    const char *moved = recording_key(look->recording, "drive_moved_s");
    if (moved != NULL) {
        char lag[QUANTITY_TEXT];
        quantity_named(lag, "", "s", strtod(moved, NULL), 4);
        fprintf(file, "; moved by %s, to when the position was sampled (header)", lag);
    }
    if (d->between == BETWEEN_UNKNOWN) {
        fprintf(file, "\n             %s\n", between[d->between]);
    } else {
        fprintf(file, "; %s%s\n", between[d->between], d->between_given ? " (header)" : "");
    }
}

static void print_map(FILE *file, const look_t *look) {
    const static_map_t *map = &look->map;
    const double noise_um = look->prediction.noise_um, stroke_um = map->stroke_um[1] - map->stroke_um[0];
    fprintf(file, "  position   ");
    print_range(file, map->stroke_um[0], map->stroke_um[1], noise_um > 0.0 ? noise_um : shown_part * stroke_um);
    fprintf(file, " um; %.3g um/V, a straight line leaves %.2g %% of the stroke", map->gain_um_per_v,
            map->line_error_percent);
    if (map->levels > 0) {
        fprintf(file, "; loop %.2g %% wide", map->width_percent);
    }
    fprintf(file, "\n");
}

static void print_share(FILE *file, const char *where, const noise_share_t *share, double stroke_um) {
    if (share->samples == 0) {
        return;
    }
    fprintf(file, "%s %.2g um (%.2g %% of the stroke; white %.2g, 1/f %.2g from %.2g Hz on", where, share->rms_um,
            100.0 * share->rms_um / stroke_um, share->white_um, share->slow_um, share->lowest_hz);
    if (share->other_um > threshold.other_of_noise * hypot(share->white_um, share->slow_um)) {
        fprintf(file, "; beside them %.2g of hum, rings or what is slower", share->other_um);
    }
    if (share->outliers > 0) {
        fprintf(file, "; %zu reading%s far outside", share->outliers, share->outliers == 1 ? "" : "s");
    }
    fprintf(file, ")");
}

static void print_noise(FILE *file, const look_t *look) {
    const noise_look_t *noise = &look->noise;
    const double stroke_um = look->map.stroke_um[1] - look->map.stroke_um[0];
    fprintf(file, "  noise      ");
    print_share(file, "at rest", &noise->rest, stroke_um);
    fprintf(file, "%s", noise->rest.samples > 0 && noise->repeat.samples > 0 ? "; " : "");
    print_share(file, "between passes", &noise->repeat, stroke_um);
    if (noise->rest.samples == 0 && noise->repeat.samples == 0) {
        if (look->prediction.noise_um > noise->step_um / sqrt(12.0)) { /* the steps' own error */
            fprintf(file, "no rest and no repetition; from neighbouring readings %.2g um if white%s",
                    look->prediction.noise_um,
                    look->prediction.fed_back ? " (the drive answers the readings: a closed loop)" : "");
        } else {
            fprintf(file, "no rest and no repetition; less than the steps between neighbouring readings");
        }
    }
    if (noise->step_um > 0.0) {
        fprintf(file, "; readings come in steps of %.4g um", noise->step_um);
    }
    fprintf(file, "\n");
    if (look->repetition.count > 0) {
        const repetition_t *r = &look->repetition;
        fprintf(file, "  repeats    to %.2g um (%.2g %%), the worst pass to %.2g um\n", r->rms_um,
                100.0 * r->rms_um / stroke_um, r->worst_um);
    }
}

static void print_response(FILE *file, const look_t *look) {
    const response_t *response = &look->response;
    const response_point_t *lowest = response_lowest(response, threshold.coherent_enough),
                           *peak = response_peak(response), *last = NULL;
    if (lowest == NULL) {
        return;
    }
    fprintf(file, "  response   %.3g um/V at %.3g Hz, lag ", lowest->gain_um_per_v, lowest->frequency_hz);
    print_rounded(file, "s", lowest->lag_s, 2);
    fprintf(file, " (%.2g deg)", -lowest->phase_rad * 180.0 / M_PI);
    for (size_t i = 0; i < response->count; i++) {
        last = response->point[i].coherence >= threshold.coherent_enough ? &response->point[i] : last;
    }
    if (peak != NULL && !(peak == last && response->goes_on_to_hz > 0.0)) {
        fprintf(file, "; most, %.3g um/V, at %.4g Hz", peak->gain_um_per_v, peak->frequency_hz);
    }
    if (last != NULL && last != lowest) {
        fprintf(file, ";\n             %.3g um/V at %.3g Hz, lag ", last->gain_um_per_v, last->frequency_hz);
        print_rounded(file, "s", last->lag_s, 2);
        fprintf(file, " (coherence %.2f)", last->coherence);
    }
    if (response->goes_on_to_hz > 0.0) {
        fprintf(file,
                ";\n             it ends there%s: the drive sweeps on to about %.4g Hz within %.2g s,\n"
                "             too fast to tell a response from how the recording ends",
                peak == last && peak != NULL ? ", and still rises" : "", response->goes_on_to_hz, response->goes_on_s);
    }
    fprintf(file, "\n");
}

static void print_ring(FILE *file, const look_t *look) {
    const ring_t *ring = &look->ring;
    if (ring->rings > 0) {
        fprintf(file, "  rings      ");
        print_value(file, "", "Hz", ring->frequency_hz, ring->frequency_sigma_hz);
        fprintf(file, " with damping ");
        print_value(file, "", "1", ring->damping, ring->damping_sigma);
        fprintf(file, " after %zu step%s; %.3g um after %.4g V at ", ring->rings, ring->rings == 1 ? "" : "s",
                ring->swing_um, ring->step_v);
        print_time(file, look->recording, recording_time(look->recording, (double)ring->at));
        fprintf(file, " s\n");
    }
}

static void print_holds(FILE *file, const look_t *look) {
    const holds_t *holds = &look->holds;
    if (holds->creep_sigma > 0.0) {
        const bool creeps = fabs(holds->creep) > threshold.edge_of_noise * holds->creep_sigma;
        fprintf(file, "  holds      %zu; %s", holds->count, creeps ? "the position goes on by " : "no creep is seen: ");
        print_value(file, "", "%", 100.0 * holds->creep, 100.0 * holds->creep_sigma);
        fprintf(file, " of the way before, per decade of time\n");
    }
}

static void print_rails(FILE *file, const look_t *look) {
    const rails_t *rails = &look->rails;
    if (rails->low) {
        fprintf(file, "  rail       below about %.4g V the position stops, and the drive goes on\n", rails->low_v);
    }
    if (rails->high) {
        fprintf(file, "  rail       above about %.4g V the position stops, and the drive goes on\n", rails->high_v);
    }
}

void fault_print(FILE *file, const look_t *looks, size_t count, const fault_t *fault) {
    const recording_t *recording = looks[fault->recording].recording;
    enum { MOST_SPANS = 6 };
    fprintf(file, "  %s", fault->kind->name);
    if (count > 1) {
        fprintf(file, " in %s", without_folder(looks[fault->recording].recording->name));
    }
    fprintf(file, ": %s\n    ", fault->kind->text);
    for (size_t i = 0; i < fault->numbers; i++) {
        const fault_number_t *n = &fault->number[i];
        fputs(i > 0 ? ", " : "", file);
        print_value(file, n->name, n->unit, n->value, n->sigma);
    }
    if (fault->spans > 0) {
        fprintf(file, "; %zu sample%s at ", fault_samples(fault, looks), fault_samples(fault, looks) == 1 ? "" : "s");
        for (size_t i = 0; i < fault->spans && i < MOST_SPANS; i++) {
            fputs(i > 0 ? ", " : "", file);
            print_time(file, recording, recording_time(recording, (double)fault->span[i].from));
        }
        fprintf(file, "%s s", fault->spans > MOST_SPANS ? " .." : "");
    }
    fprintf(file, "; by chance once in 10^%.0f recordings\n    %s\n", fmin(300.0, -floor(fault->log_chance)),
            fault->kind->change);
}

void looks_print(FILE *file, const look_t *looks, size_t count, const fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const look_t *look = &looks[i];
        const recording_t *r = look->recording;
        fprintf(file, "%s: %zu samples at %g Hz, %.4g s", without_folder(r->name), r->samples, r->sample_rate_hz,
                (double)r->samples / r->sample_rate_hz);
        if (r->start_s != 0.0) {
            fprintf(file, ", from t = ");
            print_time(file, r, r->start_s);
            fprintf(file, " s");
        }
        fprintf(file, "\n");
        print_drive(file, look);
        print_map(file, look);
        print_noise(file, look);
        print_response(file, look);
        print_ring(file, look);
        print_holds(file, look);
        print_rails(file, look);
    }
    fprintf(file, "%s\n", faults->count == 0 ? "No fault of the recording shows." : "Faults of the recording:");
    for (size_t i = 0; i < faults->count; i++) {
        fault_print(file, looks, count, &faults->fault[i]);
    }
}

void looks_print_shortly(FILE *file, const look_t *looks, size_t count, const fault_list_t *faults, size_t masked) {
    for (size_t i = 0; i < count; i++) {
        fprintf(file, "%s: %zu samples at %g Hz\n", without_folder(looks[i].recording->name),
                looks[i].recording->samples, looks[i].recording->sample_rate_hz);
        print_drive(file, &looks[i]);
        print_noise(file, &looks[i]);
        print_ring(file, &looks[i]);
        print_rails(file, &looks[i]);
    }
    fprintf(file, "%s\n", faults->count == 0 ? "No fault of the recording shows." : "Faults of the recording:");
    for (size_t i = 0; i < faults->count; i++) {
        fault_print(file, looks, count, &faults->fault[i]);
    }
    if (masked > 0) {
        fprintf(file, "%zu samples of these are left out of everything below.\n", masked);
    }
    for (size_t i = 0; i < faults->count; i++) {
        if (faults->fault[i].undone) {
            fprintf(file,
                    "%s is undone in the readings for everything below, by these numbers. "
                    "On the file as it is `hyst simulate` says more.\n",
                    faults->fault[i].kind->name);
        }
    }
    if (faults->withdrawn > 0) {
        fprintf(
            file,
            "Withdrawn: %zu of the faults that `hyst look` reports. A hysteresis of any shape explains these readings "
            "better as they are.\n",
            faults->withdrawn);
    }
    fprintf(file, "\n");
}
