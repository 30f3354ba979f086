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

const struct kind kinds[KINDS] = {
    [LATE] = {"late samples", 12},
    [MISSED] = {"missed periods", 1},
    [CONVERTER] = {"converter times out", 300},
    [SUPPLY_SAGS] = {"supply sags", 20},
    [TEMPERATURE] = {"temperature", 3000},
    [SUPPLY] = {"supply out of limits", 3000},
    [HIGH_VOLTAGE] = {"stage's supply out of limits", 3000},
    [SENSOR] = {"sensor lost or stuck", 5000},
    [HOST_DIES] = {"host dies", 20000},
    [MAIN_LOOP_HANGS] = {"main loop hangs", 20000},
    [GARBAGE] = {"garbage on the line", 2000},
    [SECOND_MASTER] = {"second master", 5000},
    [ECHO] = {"echo", 5000},
    [MEMORY] = {"memory changes", 1},
    [RESTART] = {"restart", 1},
    [POWER_CUT] = {"power cut in a store", 10000},
    [FLASH] = {"flash fails", 5000},
};
