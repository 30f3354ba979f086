/* SPDX-License-Identifier: MIT */
#include "motion/drive_range.h"

drive_window_t drive_window_outside(const drive_range_t *range, hyst_q31_t last) {
    if (last > range->high) {
        const hyst_q31_t back = hyst_subtract(last, range->return_slew);
        const hyst_q31_t to = back > range->high ? back : range->high;
        return (drive_window_t){to, to};
    }
    const hyst_q31_t back = hyst_add(last, range->return_slew);
    const hyst_q31_t to = back < range->low ? back : range->low;
    return (drive_window_t){to, to};
}
