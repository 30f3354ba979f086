/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench/converter_line.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* After the first ask: an emulator on a busy machine may pause. */
#define PATIENCE_MS 10000
/* A signal may come just before a wait; then this long passes until it is noticed. */
#define STOP_LOOK_MS 200
/* Between two looks whether the bench has opened its pipe. */
#define OPEN_LOOK_MS 20

#define CLOSED (-1)

static converter_status_t broken(const converter_line_t *line, failure_t *failure) {
    (void)fail(failure, "%s: the converter line is broken: %s", line->name, strerror(errno));
    return CONVERTER_FAILED;
}

/* The bench opens the asks first and stands still in front of the answers until this end has opened them, too. */
static converter_status_t wait_for_bench(converter_line_t *line, const char *answers, failure_t *failure) {
    while (!*line->stop) {
        line->answers = open(answers, O_WRONLY | O_NONBLOCK | O_CLOEXEC);
        if (line->answers >= 0) {
            return CONVERTER_DONE;
        }
        if (errno != ENXIO && errno != EINTR) { /* ENXIO: no reader yet */
            return broken(line, failure);
        }
        (void)poll(NULL, 0, OPEN_LOOK_MS);
    }
    return CONVERTER_ENDED;
}

static converter_status_t open_pipes(converter_line_t *line, const char *asks, const char *answers,
                                     failure_t *failure) {
    if (mkfifo(asks, S_IRUSR | S_IWUSR) != 0) {
        (void)fail(failure, "%s: cannot be made: %s", asks, strerror(errno));
        return CONVERTER_FAILED;
    }
    converter_status_t status = CONVERTER_FAILED;
    if (mkfifo(answers, S_IRUSR | S_IWUSR) != 0) {
        (void)fail(failure, "%s: cannot be made: %s", answers, strerror(errno));
    } else {
        line->asks = open(asks, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
        status = line->asks < 0 ? broken(line, failure) : wait_for_bench(line, answers, failure);
        (void)unlink(answers);
    }
    (void)unlink(asks);
    return status;
}

converter_status_t converter_open(converter_line_t *line, const char *path, const volatile sig_atomic_t *stop,
                                  failure_t *failure) {
    *line = (converter_line_t){.asks = CLOSED, .answers = CLOSED, .name = path, .stop = stop};
    char asks[4096], answers[4096];
    if ((size_t)snprintf(asks, sizeof asks, "%s.asks", path) >= sizeof asks ||
        (size_t)snprintf(answers, sizeof answers, "%s.answers", path) >= sizeof answers) {
        (void)fail(failure, "%.40s...: too long for a file's name", path);
        return CONVERTER_FAILED;
    }
    const converter_status_t status = open_pipes(line, asks, answers, failure);
    if (status != CONVERTER_DONE) {
        converter_close(line);
    }
    return status;
}

/* Whether there is something to read: CONVERTER_DONE, or the end of all waiting. */
static converter_status_t wait_for_ask(const converter_line_t *line, failure_t *failure) {
    struct pollfd wait = {.fd = line->asks, .events = POLLIN};
    for (int waited_ms = 0; !*line->stop; waited_ms += STOP_LOOK_MS) {
        if (line->asked && waited_ms >= PATIENCE_MS) {
            (void)fail(failure, "%s: no drive code for %d s", line->name, PATIENCE_MS / 1000);
            return CONVERTER_FAILED;
        }
        if (!line->asked && line->first_ask_s > 0.0 && waited_ms >= 1000.0 * line->first_ask_s) {
            (void)fail(failure, "%s: no ask in %g s: is the image firmware of the board `bench`?", line->name,
                       line->first_ask_s);
            return CONVERTER_FAILED;
        }
        const int ready = poll(&wait, 1, STOP_LOOK_MS);
        if (ready > 0) {
            return CONVERTER_DONE;
        }
        if (ready < 0 && errno != EINTR) {
            return broken(line, failure);
        }
    }
    return CONVERTER_ENDED;
}

converter_status_t converter_wait(converter_line_t *line, bool *driven, uint16_t *drive, failure_t *failure) {
    uint8_t ask[CONVERTER_ASK_BYTES];
    for (size_t count = 0; count < sizeof ask;) {
        const converter_status_t status = wait_for_ask(line, failure);
        if (status != CONVERTER_DONE) {
            return status;
        }
        const ssize_t more = read(line->asks, ask + count, sizeof ask - count);
        if (more == 0) {
            return CONVERTER_ENDED;
        }
        if (more < 0 && errno != EINTR && errno != EAGAIN) {
            return broken(line, failure);
        }
        count += more > 0 ? (size_t)more : 0;
    }
    *drive = (uint16_t)(ask[0] | ask[1] << 8);
    *driven = ask[2] != 0;
    if (!line->asked && !*driven) {
        line->rate_hz = *drive;
    }
    line->asked = true;
    return CONVERTER_DONE;
}

/* A pipe takes so few bytes as a whole, and there is room: no more than one answer is on its way. */
static converter_status_t answer(const converter_line_t *line, const uint8_t bytes[CONVERTER_ANSWER_BYTES],
                                 failure_t *failure) {
    while (write(line->answers, bytes, CONVERTER_ANSWER_BYTES) < 0) {
        if (*line->stop || errno == EPIPE) {
            return CONVERTER_ENDED;
        }
        if (errno != EINTR) {
            return broken(line, failure);
        }
    }
    return CONVERTER_DONE;
}

converter_status_t converter_answer(const converter_line_t *line, uint16_t position, uint32_t supply_mv,
                                    failure_t *failure) {
    const uint8_t bytes[CONVERTER_ANSWER_BYTES] = {
        (uint8_t)position,          (uint8_t)(position >> 8),  1, 0, (uint8_t)supply_mv, (uint8_t)(supply_mv >> 8),
        (uint8_t)(supply_mv >> 16), (uint8_t)(supply_mv >> 24)};
    return answer(line, bytes, failure);
}

converter_status_t converter_not_yet(const converter_line_t *line, failure_t *failure) {
    static const uint8_t nothing[CONVERTER_ANSWER_BYTES];
    return answer(line, nothing, failure);
}

void converter_close(converter_line_t *line) {
    int *const file[] = {&line->asks, &line->answers};
    for (size_t i = 0; i < sizeof file / sizeof file[0]; i++) {
        if (*file[i] != CLOSED) {
            (void)close(*file[i]);
            *file[i] = CLOSED;
        }
    }
}
