/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Who may talk to the server: a browser page that this server gave out, to somebody who has its address.
 *
 * The address holds a random token. A page of another site cannot read it, and is refused by its origin besides. A name
 * of another site that resolves to this machine is refused by the host that the browser asks for.
 */
#ifndef ACCESS_H
#define ACCESS_H

#include "base/failure.h"

/** Characters of a token: 128 random bits in hexadecimal. */
#define ACCESS_TOKEN_LENGTH 32

/** Draws a token from the system's random numbers. */
bool access_draw_token(char token[ACCESS_TOKEN_LENGTH + 1], failure_t *failure);

/** Header `Host`: the loopback address or localhost, with this port. */
bool access_host_allowed(const char *host, int port);

/** Header `Origin`: this server. */
bool access_origin_allowed(const char *origin, int port);

/** What follows "/TOKEN/" in the path, or NULL if the path does not begin so. */
const char *access_rest_of_path(const char *path, const char *token);

#endif
