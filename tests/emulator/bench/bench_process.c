/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "bench_process.h"
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

static pid_t process = -1;
static char port[64];

const char *bench_start(const char *model, const char *log) {
    int output[2];
    if (pipe(output) != 0) {
        perror("pipe");
        exit(1);
    }
    process = fork();
    if (process == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
        (void)dup2(output[1], STDOUT_FILENO);
        (void)close(output[0]);
        (void)execl(HYST_TOOL, HYST_TOOL, "bench", "--image", BENCH_IMAGE, "--model", model, "--noise-um", "0.005",
                    "--resonance", "2000:0.02", "--log", log, (char *)NULL);
        perror(HYST_TOOL);
        _exit(1);
    }
    (void)close(output[1]);
    FILE *lines = fdopen(output[0], "r");
    if (process < 0 || lines == NULL || fscanf(lines, "port: %63s", port) != 1) {
        (void)fprintf(stderr, "no port from %s bench\n", HYST_TOOL);
        exit(1);
    }
    return port; /* the pipe stays open: the bench may print more */
}

bool bench_stop(void) {
    int status = 0;
    if (process <= 0 || kill(process, SIGTERM) != 0 || waitpid(process, &status, 0) != process) {
        return false;
    }
    process = -1;
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}
