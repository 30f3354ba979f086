/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Units that files of measurements write. */
#ifndef UNITS_H
#define UNITS_H

#include <stdbool.h>

typedef enum {
    QUANTITY_UNKNOWN,
    QUANTITY_TIME,        /**< in s */
    QUANTITY_VOLTAGE,     /**< in V */
    QUANTITY_LENGTH,      /**< in um */
    QUANTITY_CURRENT,     /**< in A */
    QUANTITY_TEMPERATURE, /**< in degC: of kelvins the scale is right and the offset not, so they are unknown */
    QUANTITY_FREQUENCY,   /**< in Hz */
    QUANTITY_INDEX,       /**< sample numbers */
    QUANTITY_DIGITS       /**< of a converter, which stand for something else */
} quantity_t;

/** The quantity of a unit, and the factor that converts it to the unit above. Names in full, abbreviated, in upper and
 * lower case where that is no prefix ("mV" and "MV" differ), with Greek or Latin mu. */
quantity_t unit_of(const char *text, double *scale);

/** The unit that the project uses: "s", "V", "um", "A", "degC", "Hz", "". */
const char *unit_name(quantity_t quantity);

/** Room for a name or a unit. */
enum { UNIT_FIELD = 120 };

/** Takes the unit out of a name: "Time [s]", "V_in (mV)", "position/um", "pos_nm", "x in mm", "U,V",
 * "Time..ms.", "driveMv". Unknown units stay
 * in the name unless they are in brackets. Of "[ms]" no name is left, of "x/nm (axis 1)" is "x (axis 1)". `between`:
 * the characters, last one first, behind which a unit may stand without brackets. "Channel A" has no amperes; "Current
 * A" has. unit has UNIT_FIELD characters.
 */
void unit_split(char *name, char *unit, const char *between);

/** Whether a name says that its numbers are a part or a multiple of what it names: "HV monitor (1:100)", "Vin x20",
 * "Vin 20x"; `divided`: and "Drive/20", which of other columns is a type. */
bool unit_states_scale(const char *name, bool divided);

#endif
