/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench/converter_line.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

/* Until the first answer: a board drops frames while it boots. */
#define START_PATIENCE_MS 20
/* Afterwards: an emulator on a busy machine may pause, and a repeated frame would add a sample. */
#define PATIENCE_MS 10000
/* Answers to repeated frames have all arrived when the line has been silent for as long as the first answer took, and
 * this; a board that only has to start takes no longer than a second to answer. */
#define SILENCE_MS      20
#define SILENCE_MOST_MS 1000
/* A signal may come just before a wait; then this long passes until it is noticed. */
#define STOP_LOOK_MS 200

void converter_encode(uint16_t code, uint8_t frame[CONVERTER_FRAME_BYTES]) {
    frame[0] = (uint8_t)(0x80U | (code >> 14));
    frame[1] = (uint8_t)((code >> 7) & 0x7FU);
    frame[2] = (uint8_t)(code & 0x7FU);
}

void converter_put_beside(converter_beside_t *beside, uint32_t number, uint8_t frame[CONVERTER_FRAME_BYTES]) {
    unsigned bits = 0;
    if (beside->left == 0 && number != 0) {
        *beside = (converter_beside_t){.word = number, .left = CONVERTER_BESIDE_CODES};
        bits = 0x10U;
    }
    if (beside->left > 0) {
        bits |= beside->word >> 16 & 0xFU;
        beside->word <<= 4;
        beside->left--;
    }
    frame[0] = (uint8_t)(frame[0] | bits << 2);
}

bool converter_decode(converter_decoder_t *decoder, uint8_t byte, uint16_t *code) {
    if ((byte & 0x80U) != 0) {
        decoder->bytes = 1;
        decoder->bits = byte & 0x03U;
        return false;
    }
    if (decoder->bytes == 0) {
        return false;
    }
    decoder->bits = (decoder->bits << 7) | byte;
    decoder->bytes++;
    if (decoder->bytes < CONVERTER_FRAME_BYTES) {
        return false;
    }
    decoder->bytes = 0;
    *code = (uint16_t)decoder->bits;
    return true;
}

static bool broken(const converter_line_t *line, failure_t *failure) {
    return fail(failure, "%s: the converter line is broken: %s", line->name, strerror(errno));
}

static converter_status_t accept_partner(converter_line_t *line, int listener, failure_t *failure) {
    struct pollfd wait = {.fd = listener, .events = POLLIN};
    for (;;) {
        if (*line->stop) {
            return CONVERTER_ENDED;
        }
        const int ready = poll(&wait, 1, STOP_LOOK_MS);
        if (ready == 0) {
            continue;
        }
        if (ready > 0) {
            line->file = accept(listener, NULL, NULL);
            if (line->file >= 0) {
                return CONVERTER_DONE;
            }
        }
        if (errno != EINTR) {
            (void)broken(line, failure);
            return CONVERTER_FAILED;
        }
    }
}

static converter_status_t listen_at(converter_line_t *line, failure_t *failure) {
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(line->name) >= sizeof address.sun_path) {
        (void)fail(failure, "%s: too long for a socket (%zu characters at most)", line->name,
                   sizeof address.sun_path - 1);
        return CONVERTER_FAILED;
    }
    memcpy(address.sun_path, line->name, strlen(line->name));
    const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
    if (listener < 0 || bind(listener, (const struct sockaddr *)&address, sizeof address) != 0 ||
        listen(listener, 1) != 0) {
        (void)fail(failure, "%s: cannot listen there: %s", line->name, strerror(errno));
        if (listener >= 0) {
            (void)close(listener);
        }
        return CONVERTER_FAILED;
    }
    const converter_status_t status = accept_partner(line, listener, failure);
    (void)close(listener);
    (void)unlink(line->name);
    return status;
}

static converter_status_t open_terminal(converter_line_t *line, failure_t *failure) {
    line->file = open(line->name, O_RDWR | O_NOCTTY);
    struct termios settings;
    if (line->file < 0 || tcgetattr(line->file, &settings) != 0) {
        (void)fail(failure, "%s: cannot be opened as a serial line: %s", line->name, strerror(errno));
        return CONVERTER_FAILED;
    }
    settings.c_iflag = 0;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    settings.c_cflag = (settings.c_cflag & ~(tcflag_t)(CSIZE | PARENB)) | CS8 | CREAD | CLOCAL;
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if (tcsetattr(line->file, TCSANOW, &settings) != 0) {
        (void)broken(line, failure);
        return CONVERTER_FAILED;
    }
    return CONVERTER_DONE;
}

converter_status_t converter_open(converter_line_t *line, const char *path, const volatile sig_atomic_t *stop,
                                  failure_t *failure) {
    *line = (converter_line_t){.file = -1, .name = path, .stop = stop};
    struct stat what;
    const bool terminal = stat(path, &what) == 0 && S_ISCHR(what.st_mode);
    const converter_status_t status = terminal ? open_terminal(line, failure) : listen_at(line, failure);
    if (status != CONVERTER_DONE) {
        converter_close(line);
    }
    return status;
}

static converter_status_t send_code(converter_line_t *line, uint16_t code, failure_t *failure) {
    uint8_t frame[CONVERTER_FRAME_BYTES];
    converter_encode(code, frame);
    converter_put_beside(&line->beside, line->supply_mv, frame);
    for (size_t sent = 0; sent < sizeof frame;) {
        const ssize_t count = write(line->file, frame + sent, sizeof frame - sent);
        if (count > 0) {
            sent += (size_t)count;
        } else if (*line->stop || errno == EPIPE) {
            return CONVERTER_ENDED;
        } else if (errno != EINTR) {
            (void)broken(line, failure);
            return CONVERTER_FAILED;
        }
    }
    return CONVERTER_DONE;
}

/* Waits for one code. *silent tells whether there was none in time. */
static converter_status_t receive_code(converter_line_t *line, int patience_ms, uint16_t *code, bool *silent,
                                       failure_t *failure) {
    struct pollfd wait = {.fd = line->file, .events = POLLIN};
    *silent = false;
    for (;;) {
        const int ready = poll(&wait, 1, patience_ms);
        if (*line->stop) {
            return CONVERTER_ENDED;
        }
        if (ready == 0) {
            *silent = true;
            return CONVERTER_DONE;
        }
        uint8_t bytes[64];
        const ssize_t count = ready > 0 ? read(line->file, bytes, sizeof bytes) : -1;
        if (count == 0 || (count < 0 && (errno == EIO || errno == ECONNRESET))) {
            return CONVERTER_ENDED; /* EIO: the other end of a pseudo-terminal was closed */
        }
        if (count < 0 && errno != EINTR) {
            (void)broken(line, failure);
            return CONVERTER_FAILED;
        }
        bool complete = false;
        for (ssize_t i = 0; i < count; i++) {
            complete = converter_decode(&line->decoder, bytes[i], code) || complete;
        }
        if (complete) {
            return CONVERTER_DONE;
        }
    }
}

converter_status_t converter_exchange(converter_line_t *line, uint16_t position, uint16_t *drive, failure_t *failure) {
    const unsigned long repetitions = line->repetitions;
    for (;;) {
        bool silent = false;
        converter_status_t status = send_code(line, position, failure);
        if (status == CONVERTER_DONE) {
            status = receive_code(line, line->answered ? PATIENCE_MS : START_PATIENCE_MS, drive, &silent, failure);
        }
        if (status != CONVERTER_DONE) {
            return status;
        }
        if (!silent) {
            break;
        }
        if (line->answered) {
            (void)fail(failure, "%s: no drive code for %d s", line->name, PATIENCE_MS / 1000);
            return CONVERTER_FAILED;
        }
        line->repetitions++;
    }
    line->answered = true;
    /* Further answers belong to the repeated frames; taking one for the answer to the next code would add a sample of
     * delay for good. */
    const unsigned long frames = line->repetitions - repetitions + 1;
    const unsigned long waited_ms = frames * START_PATIENCE_MS;
    const int silence_ms = SILENCE_MS + (int)(waited_ms < SILENCE_MOST_MS ? waited_ms : SILENCE_MOST_MS);
    for (bool silent = frames == 1; !silent;) {
        const converter_status_t status = receive_code(line, silence_ms, drive, &silent, failure);
        if (status != CONVERTER_DONE) {
            return status;
        }
    }
    return CONVERTER_DONE;
}

void converter_close(converter_line_t *line) {
    if (line->file >= 0) {
        (void)close(line->file);
        line->file = -1;
    }
}
