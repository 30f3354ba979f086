/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the live page can do: its messages, in both directions, between the pages, the line and the jobs.
 *
 * The first page has control. Others see everything and may stop the amplifier, which is never refused, and change
 * nothing else. When the page in control has gone, another may take its place.
 *
 * A message is a JSON object. From a page {"do": "stop"|"record"|"track"|"push"|"clear"|"fit"|"diagnose"|"compile"|
 * "look"|"simulate"|"report"|"import"|"upload"|"cancel"|"show"|"take"}; to a page {"event": ..}. docs/LIVE.md has the
 * list.
 */
#ifndef SESSION_H
#define SESSION_H

#include "amplifier/device/device.h"
#include <signal.h>

typedef struct session session_t;

typedef struct {
    device_options_t line;
    const char *folder; /**< where its files are */
    int port;           /**< to listen on; 0: any */
    bool simulated;     /**< the amplifier is emulated and the actuator simulated, which the page says */
    /** Of the converters, where known: what the page proposes for an amplifier without parameters; both 0: unknown. */
    double drive_range_v[2], position_range_um[2];
    /** The line was lost, or has not come from the start (why), or has come (NULL; again with each image). From another
     * thread, one call at a time. */
    void (*line_changed)(void *context, const char *why);
    void *context;
} session_options_t;

/** The options and their strings must outlive it. NULL on failure. */
session_t *session_open(const session_options_t *options, failure_t *failure);
/** Parks what is driven, ends jobs. NULL is allowed. */
void session_close(session_t *session);

const char *session_address(const session_t *session);

/** Serves until *stop is not 0. */
bool session_run(session_t *session, const volatile sig_atomic_t *stop, failure_t *failure);

#endif
