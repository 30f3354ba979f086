/* SPDX-License-Identifier: MIT */
#include "lives.h"

const rule_text_t rule_text[RULES] = {
    [RULE_STEP] = {"all of these at once: steps", "no step beyond what the board allows, in any sample"},
    [RULE_RANGE] = {"all of these at once: limits",
                    "the drive is within image and registers in every sample, or on its way back by transition_slew"},
    [RULE_STAGE] = {"all of these at once: stage",
                    "it comes on at the parking drive, once for each arming that was accepted"},
    [RULE_STATES] = {"all of these at once: states", "every change of state is a command or a fault"},
    [RULE_LATCH] = {"all of these at once: fault", "out only by stop, or by a restart to off"},
    [RULE_RAMP] = {"all of these at once: reaction",
                   "in a fault every sample is nearer to park, then the stage is off"},
    [RULE_SILENCE] = {"all of these at once: silent master", "fault within the communication timeout, in periods"},
    [RULE_CAUSE] = {"all of these at once: cause", "no fault without its cause"},
    [RULE_STORE] = {"all of these at once: store", "a start has the old copy or the new one, whole"},
    [RULE_LINE] = {"all of these at once: line", "each whole request is answered once, and nothing else is"},
};
