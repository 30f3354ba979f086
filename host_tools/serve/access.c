/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/access.h"
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>

bool access_draw_token(char token[ACCESS_TOKEN_LENGTH + 1], failure_t *failure) {
    uint8_t random[ACCESS_TOKEN_LENGTH / 2];
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random) {
        return fail(failure, "the system gives no random numbers: %s", strerror(errno));
    }
    for (size_t i = 0; i < sizeof random; i++) {
        (void)snprintf(token + 2 * i, 3, "%02x", (unsigned)random[i]);
    }
    return true;
}

bool access_host_allowed(const char *host, int port) {
    static const char *const names[] = {"127.0.0.1", "localhost"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char allowed[40];
        (void)snprintf(allowed, sizeof allowed, "%s:%d", names[i], port);
        if (strcmp(host, allowed) == 0) {
            return true;
        }
    }
    return false;
}

bool access_origin_allowed(const char *origin, int port) {
    static const char scheme[] = "http://";
    return strncmp(origin, scheme, strlen(scheme)) == 0 && access_host_allowed(origin + strlen(scheme), port);
}

const char *access_rest_of_path(const char *path, const char *token) {
    const size_t length = strlen(token);
    if (path[0] != '/' || strlen(path) < length + 2) {
        return NULL;
    }
    unsigned differ = 0; /* the time taken tells nothing about where */
    for (size_t i = 0; i < length; i++) {
        differ |= (unsigned)(path[1 + i] ^ token[i]);
    }
    return differ == 0 && path[1 + length] == '/' ? path + length + 2 : NULL;
}
