/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "emulator.h"
#include "monotonic_clock.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

/* Until the emulator has said where its pseudo-terminal is. */
#define START_S 30.0

#define CLOSED (-1)

static void close_file(int *file) {
    if (*file != CLOSED) {
        (void)close(*file);
        *file = CLOSED;
    }
}

/* In the child process. */
static void run_emulator(const char *program, const char *image, int converter_line, int output, pid_t parent) {
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) { /* it has ended before we asked to be told */
        _exit(STATUS_FAILED);
    }
    char converter[64];
    (void)snprintf(converter, sizeof converter, "socket,id=converter,fd=%d", converter_line);
    (void)dup2(output, STDOUT_FILENO);
    (void)execlp(program, program, "-M", "netduinoplus2", "-kernel", image, "-display", "none", "-monitor", "none",
                 "-serial", "pty", "-chardev", converter, "-serial", "chardev:converter", (char *)NULL);
    (void)fprintf(stderr, "hyst: cannot run %s: %s\n", program, strerror(errno));
    _exit(STATUS_FAILED);
}

/* Reads the line "char device redirected to /dev/pts/N (label serial0)". */
static bool read_port(emulator_t *emulator, failure_t *failure) {
    static const char before[] = "redirected to ";
    char text[512] = "";
    size_t length = 0;
    const double until_s = monotonic_s() + START_S;
    struct pollfd wait = {.fd = emulator->output, .events = POLLIN};
    while (length < sizeof text - 1 && monotonic_s() < until_s) {
        if (poll(&wait, 1, 100) <= 0) {
            continue;
        }
        const ssize_t count = read(emulator->output, text + length, sizeof text - 1 - length);
        if (count <= 0) {
            return fail(failure, "the emulator ended before it had opened its lines");
        }
        length += (size_t)count;
        text[length] = '\0';
        const char *port = strstr(text, before);
        if (port != NULL && strchr(port, '(') != NULL) {
            return sscanf(port + strlen(before), "%63s", emulator->port) == 1 ||
                   fail(failure, "the emulator names no pseudo-terminal: %s", text);
        }
    }
    return fail(failure, "the emulator does not say where its pseudo-terminal is");
}

/*
 * The emulator looks only once a second whether somebody has opened a pseudo-terminal that nobody had open. Holding it
 * open saves every command that second. Raw, because until then the terminal would echo.
 */
static bool hold_port(emulator_t *emulator, failure_t *failure) {
    emulator->port_holder = open(emulator->port, O_RDWR | O_NOCTTY | O_CLOEXEC);
    struct termios settings;
    if (emulator->port_holder < 0 || tcgetattr(emulator->port_holder, &settings) != 0) {
        return fail(failure, "cannot open %s: %s", emulator->port, strerror(errno));
    }
    settings.c_iflag = 0;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    return tcsetattr(emulator->port_holder, TCSANOW, &settings) == 0 ||
           fail(failure, "cannot set up %s: %s", emulator->port, strerror(errno));
}

bool emulator_start(emulator_t *emulator, const char *program, const char *image, failure_t *failure) {
    *emulator = (emulator_t){.process = -1, .converter_line = CLOSED, .output = CLOSED, .port_holder = CLOSED};
    if (access(image, R_OK) != 0) { /* before the emulator says it in its own words */
        return fail(failure, "%s: %s", image, strerror(errno));
    }
    int lines[2];
    int output[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, lines) != 0) {
        return fail(failure, "cannot make the converter line: %s", strerror(errno));
    }
    if (pipe(output) != 0) {
        (void)close(lines[0]);
        (void)close(lines[1]);
        return fail(failure, "cannot make a pipe: %s", strerror(errno));
    }
    (void)fcntl(lines[0], F_SETFD, FD_CLOEXEC);
    (void)fcntl(output[0], F_SETFD, FD_CLOEXEC);
    const pid_t parent = getpid();
    (void)fflush(NULL);
    emulator->process = fork();
    if (emulator->process == 0) {
        run_emulator(program, image, lines[1], output[1], parent);
    }
    (void)close(lines[1]);
    (void)close(output[1]);
    emulator->converter_line = lines[0];
    emulator->output = output[0];
    bool ok = emulator->process > 0 || fail(failure, "cannot start a process: %s", strerror(errno));
    ok = ok && read_port(emulator, failure) && hold_port(emulator, failure);
    if (!ok) {
        failure_t ignored;
        (void)emulator_stop(emulator, &ignored);
    }
    return ok;
}

bool emulator_stop(emulator_t *emulator, failure_t *failure) {
    bool ok = true;
    if (emulator->process > 0) {
        int status = 0;
        if (waitpid(emulator->process, &status, WNOHANG) == emulator->process) {
            ok = fail(failure,
                      WIFSIGNALED(status) ? "the emulator was ended by signal %d" : "the emulator ended with status %d",
                      WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
        } else {
            (void)kill(emulator->process, SIGKILL); /* it has nothing to save, and says nothing this way */
            (void)waitpid(emulator->process, &status, 0);
        }
        emulator->process = -1;
    }
    close_file(&emulator->converter_line);
    close_file(&emulator->output);
    close_file(&emulator->port_holder);
    return ok;
}
