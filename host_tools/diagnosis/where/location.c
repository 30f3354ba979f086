/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/location.h"

const char *loop_part_name(loop_part_t part) {
    static const char *const names[] = {"everywhere", "turning points", "mid branch", "holds"};
    return names[part];
}
