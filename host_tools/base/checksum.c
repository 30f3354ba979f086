/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/checksum.h"
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <sys/stat.h>

enum { PIECE = 65536 };

bool file_sha256(const char *path, char text[65]) {
    unsigned char piece[PIECE], digest[SHA256_DIGEST_SIZE];
    struct sha256_ctx context;
    struct stat what;
    size_t length;
    FILE *file = stat(path, &what) == 0 && S_ISREG(what.st_mode) ? fopen(path, "rb") : NULL;
    if (file == NULL) {
        return false;
    }
    sha256_init(&context);
    while ((length = fread(piece, 1, sizeof piece, file)) > 0) {
        sha256_update(&context, length, piece);
    }
    const bool good = ferror(file) == 0;
    fclose(file);
    sha256_digest(&context, sizeof digest, digest);
    base16_encode_update(text, sizeof digest, digest);
    text[64] = '\0';
    return good;
}
