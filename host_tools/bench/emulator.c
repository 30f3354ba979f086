/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench/emulator.h"
#include "base/monotonic_clock.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

/* Until the emulator has said where its pseudo-terminal is; and from there to the first ask of the image. */
#define START_S 30.0
/* Between the end of its line and its own. */
#define END_S  5.0
#define POLL_S 0.02

#define CLOSED (-1)

static void close_file(int *file) {
    if (*file != CLOSED) {
        (void)close(*file);
        *file = CLOSED;
    }
}

enum { READ_END, WRITE_END };

/* Between the two processes: each inherits one end of it and must not keep the other. */
typedef struct {
    int asks[2], answers[2]; /* of the converter line */
    int output[2];           /* of the emulator */
    int trouble[2];          /* why the program did not start */
} pipes_t;

static bool make_pipe(int ends[2], failure_t *failure) {
    return (pipe(ends) == 0 && fcntl(ends[READ_END], F_SETFD, FD_CLOEXEC) == 0 &&
            fcntl(ends[WRITE_END], F_SETFD, FD_CLOEXEC) == 0) ||
           fail(failure, "cannot make a pipe: %s", strerror(errno));
}

static bool make_pipes(pipes_t *pipes, failure_t *failure) {
    *pipes = (pipes_t){{CLOSED, CLOSED}, {CLOSED, CLOSED}, {CLOSED, CLOSED}, {CLOSED, CLOSED}};
    return make_pipe(pipes->asks, failure) && make_pipe(pipes->answers, failure) && make_pipe(pipes->output, failure) &&
           make_pipe(pipes->trouble, failure);
}

/* In the child process. The image opens its ends of the converter line by name, which are the arguments. */
static void run_emulator(const char *program, const char *image, const pipes_t *pipes, pid_t parent) {
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) { /* the parent ended before the signal was set up */
        _exit(STATUS_FAILED);
    }
    char semihosting[128];
    (void)snprintf(semihosting, sizeof semihosting, "enable=on,target=native,arg=/dev/fd/%d,arg=/dev/fd/%d",
                   pipes->asks[WRITE_END], pipes->answers[READ_END]);
    (void)fcntl(pipes->asks[WRITE_END], F_SETFD, 0);
    (void)fcntl(pipes->answers[READ_END], F_SETFD, 0);
    (void)dup2(pipes->output[WRITE_END], STDOUT_FILENO);
    (void)execlp(program, program, "-M", "netduinoplus2", "-kernel", image, "-display", "none", "-monitor", "none",
                 "-serial", "pty", "-semihosting-config", semihosting, (char *)NULL);
    const int error = errno;
    (void)!write(pipes->trouble[WRITE_END], &error, sizeof error);
    _exit(STATUS_FAILED);
}

/* The kernel closes `trouble` when the program starts; if it does not start, `trouble` carries the reason. */
static bool runs(const char *program, int trouble, failure_t *failure) {
    int error = 0;
    ssize_t count;
    do {
        count = read(trouble, &error, sizeof error);
    } while (count < 0 && errno == EINTR);
    return count != (ssize_t)sizeof error || fail(failure, "cannot run %s: %s", program, strerror(error));
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

/* Whether the file `number` of the process is the master of the pseudo-terminal with this index. Kernels before 4.14 do
 * not tell which one a master has: any counts there. */
static bool is_master(pid_t process, const char *number, int index) {
    char path[512];
    char target[64] = "";
    (void)snprintf(path, sizeof path, "/proc/%ld/fd/%s", (long)process, number);
    if (readlink(path, target, sizeof target - 1) <= 0 || strstr(target, "ptmx") == NULL) {
        return false;
    }
    (void)snprintf(path, sizeof path, "/proc/%ld/fdinfo/%s", (long)process, number);
    FILE *file = fopen(path, "r");
    char line[256];
    int found = index;
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        static const char key[] = "tty-index:";
        if (strncmp(line, key, strlen(key)) == 0) {
            found = (int)strtol(line + strlen(key), NULL, 10);
        }
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    return found == index;
}

/*
 * When an emulator ends it releases its pseudo-terminal, and another program may get the number. The number is not
 * reused while the emulator holds the master, and afterwards while this process keeps the terminal open.
 */
static bool owns_port(const emulator_t *emulator) {
    static const char before[] = "/dev/pts/";
    char path[64];
    if (strncmp(emulator->port, before, strlen(before)) != 0) {
        return false;
    }
    const int index = (int)strtol(emulator->port + strlen(before), NULL, 10);
    (void)snprintf(path, sizeof path, "/proc/%ld/fd", (long)emulator->process);
    DIR *folder = opendir(path);
    bool owned = false;
    for (const struct dirent *entry; !owned && folder != NULL && (entry = readdir(folder)) != NULL;) {
        owned = is_master(emulator->process, entry->d_name, index);
    }
    if (folder != NULL) {
        (void)closedir(folder);
    }
    return owned;
}

/*
 * The emulator checks only once a second whether a closed pseudo-terminal has been opened. Keeping it open saves every
 * command that second. Raw mode, because the terminal would otherwise echo until then.
 */
static bool hold_port(emulator_t *emulator, failure_t *failure) {
    emulator->port_holder = open(emulator->port, O_RDWR | O_NOCTTY | O_CLOEXEC);
    struct termios settings;
    if (emulator->port_holder < 0) {
        return fail(failure, "cannot open %s: %s", emulator->port, strerror(errno));
    }
    if (!owns_port(emulator)) { /* looked at after opening: see there */
        return fail(failure, "%s is not the emulator's pseudo-terminal, or no longer: it is left alone",
                    emulator->port);
    }
    if (tcgetattr(emulator->port_holder, &settings) != 0) {
        return fail(failure, "cannot set up %s: %s", emulator->port, strerror(errno));
    }
    settings.c_iflag = 0;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    return tcsetattr(emulator->port_holder, TCSANOW, &settings) == 0 ||
           fail(failure, "cannot set up %s: %s", emulator->port, strerror(errno));
}

bool emulator_start(emulator_t *emulator, const char *program, const char *image, failure_t *failure) {
    *emulator = (emulator_t)EMULATOR_NONE;
    if (access(image, R_OK) != 0) { /* before the emulator prints a message about it */
        return fail(failure, "%s: %s", image, strerror(errno));
    }
    pipes_t pipes;
    bool ok = make_pipes(&pipes, failure);
    if (ok) {
        const pid_t parent = getpid();
        emulator->process = fork();
        if (emulator->process == 0) {
            run_emulator(program, image, &pipes, parent);
        }
        ok = emulator->process > 0 || fail(failure, "cannot start a process: %s", strerror(errno));
    }
    close_file(&pipes.asks[WRITE_END]);
    close_file(&pipes.answers[READ_END]);
    close_file(&pipes.output[WRITE_END]);
    close_file(&pipes.trouble[WRITE_END]);
    emulator->line = (converter_line_t){
        .asks = pipes.asks[READ_END], .answers = pipes.answers[WRITE_END], .name = "bench", .first_ask_s = START_S};
    emulator->output = pipes.output[READ_END];
    ok = ok && runs(program, pipes.trouble[READ_END], failure);
    close_file(&pipes.trouble[READ_END]);
    ok = ok && read_port(emulator, failure) && hold_port(emulator, failure);
    if (!ok) {
        failure_t ignored;
        (void)emulator_stop(emulator, &ignored);
    }
    return ok;
}

/* Always false. */
static bool ended(int status, failure_t *failure) {
    return fail(failure,
                WIFSIGNALED(status) ? "the emulator was ended by signal %d" : "the emulator ended with status %d",
                WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
}

bool emulator_has_ended(emulator_t *emulator, failure_t *failure) {
    int status = 0;
    pid_t found = 0;
    for (const double until_s = monotonic_s() + END_S; found == 0 && monotonic_s() < until_s;) {
        sleep_until(monotonic_s() + POLL_S);
        found = waitpid(emulator->process, &status, WNOHANG);
    }
    if (found != emulator->process) {
        return fail(failure, "the emulator has closed its line");
    }
    emulator->process = -1;
    return ended(status, failure);
}

bool emulator_stop(emulator_t *emulator, failure_t *failure) {
    bool ok = true;
    if (emulator->process > 0) {
        int status = 0;
        if (waitpid(emulator->process, &status, WNOHANG) == emulator->process) {
            ok = ended(status, failure);
        } else {
            (void)kill(emulator->process, SIGKILL); /* it has nothing to save, and says nothing this way */
            (void)waitpid(emulator->process, &status, 0);
        }
        emulator->process = -1;
    }
    converter_close(&emulator->line);
    close_file(&emulator->output);
    close_file(&emulator->port_holder);
    return ok;
}
