/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/location.h"

const char *loop_part_name(loop_part_t part) {
    static const char *const names[] = {"everywhere", "turning points", "mid branch", "holds"};
    return names[part];
}

void ranges_note_whole(ranges_t *ranges, double low, double high) {
    static const double cell = 1.0 / 24.0;
    const double margin = cell * (high - low);
    ranges->whole = ranges->count == 1 && ranges->range[0].from <= low + margin && ranges->range[0].to >= high - margin;
}
