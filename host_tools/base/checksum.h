/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef CHECKSUM_H
#define CHECKSUM_H

#include <stdbool.h>

/** SHA-256 of a file's contents (FIPS 180-4, by nettle), in hexadecimal. false: no regular file, or not readable. */
bool file_sha256(const char *path, char text[65]);

#endif
