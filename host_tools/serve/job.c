/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/job.h"
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* Less urgent than the line, and than an emulated amplifier. */
#define JOB_NICENESS 10

struct job {
    pthread_t thread;
    pid_t process;
    FILE *output;
    job_listener_t listener;
    pthread_mutex_t lock;
    bool running; /* the process was not waited for yet; under the lock */
};

/* "progress: 43 % fitting" (command_line/progress_bar.c). Returns "fitting", or NULL for another line. */
static const char *read_progress(const char *line, double *fraction) {
    static const char before[] = "progress: ";
    static const char between[] = " % ";
    if (strncmp(line, before, strlen(before)) != 0) {
        return NULL;
    }
    char *end = NULL;
    *fraction = strtod(line + strlen(before), &end) / 100.0;
    return strncmp(end, between, strlen(between)) == 0 ? end + strlen(between) : NULL;
}

static void *listen_to(void *context) {
    job_t *const job = context;
    char *line = NULL;
    size_t size = 0;
    for (ssize_t length; (length = getline(&line, &size, job->output)) >= 0;) {
        double fraction;
        if (length > 0 && line[length - 1] == '\n') {
            line[length - 1] = '\0';
        }
        const char *const what = read_progress(line, &fraction);
        if (what != NULL) {
            job->listener.progress(job->listener.context, what, fraction);
        } else {
            job->listener.line(job->listener.context, line);
        }
    }
    free(line);
    (void)fclose(job->output);
    siginfo_t info;
    while (waitid(P_PID, (id_t)job->process, &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
    pthread_mutex_lock(&job->lock); /* from here on its number may be another's */
    int status = 0;
    (void)waitpid(job->process, &status, 0);
    job->running = false;
    pthread_mutex_unlock(&job->lock);
    job->listener.ended(job->listener.context, WIFEXITED(status) ? WEXITSTATUS(status) : -1);
    return NULL;
}

/* The environment of this process and one more variable. */
static char **job_environment(void) {
    static char progress[] = "HYST_PROGRESS=lines";
    size_t count = 0;
    while (environ[count] != NULL) {
        count++;
    }
    char **list = allocate(count + 2, sizeof *list);
    list[0] = progress;
    memcpy(list + 1, environ, count * sizeof *list);
    return list;
}

static bool spawn(job_t *job, const char *const argument[JOB_ARGUMENTS], int output, failure_t *failure) {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    (void)posix_spawn_file_actions_init(&actions);
    (void)posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    (void)posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
    (void)posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
    (void)posix_spawnattr_init(&attributes);
    /* Ctrl-C at the server's terminal is the server's. A job whose server was killed ends with its next line, by the
     * signal that the server ignores. */
    sigset_t defaults;
    (void)sigemptyset(&defaults);
    (void)sigaddset(&defaults, SIGPIPE);
    (void)posix_spawnattr_setsigdefault(&attributes, &defaults);
    (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
    char program[] = "hyst";
    char *arguments[JOB_ARGUMENTS + 1] = {program};
    for (size_t i = 0; i < JOB_ARGUMENTS && argument[i] != NULL; i++) {
        arguments[i + 1] = copy_text(argument[i]);
    }
    char **environment = job_environment();
    const int error = posix_spawn(&job->process, "/proc/self/exe", &actions, &attributes, arguments, environment);
    free((void *)environment);
    for (size_t i = 1; arguments[i] != NULL; i++) {
        free(arguments[i]);
    }
    (void)posix_spawn_file_actions_destroy(&actions);
    (void)posix_spawnattr_destroy(&attributes);
    if (error != 0) {
        return fail(failure, "cannot start hyst %s: %s", argument[0], strerror(error));
    }
    (void)setpriority(PRIO_PROCESS, (id_t)job->process, JOB_NICENESS);
    job->running = true;
    return true;
}

job_t *job_start(const char *const argument[JOB_ARGUMENTS], const job_listener_t *listener, failure_t *failure) {
    int ends[2];
    if (pipe(ends) != 0) {
        (void)fail(failure, "cannot make a pipe: %s", strerror(errno));
        return NULL;
    }
    (void)fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    (void)fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    job_t *job = allocate(1, sizeof *job);
    job->listener = *listener;
    (void)pthread_mutex_init(&job->lock, NULL);
    const bool spawned = spawn(job, argument, ends[1], failure);
    (void)close(ends[1]);
    job->output = fdopen(ends[0], "r");
    if (!spawned) {
        (void)fclose(job->output);
        free(job);
        return NULL;
    }
    const int error = pthread_create(&job->thread, NULL, listen_to, job);
    if (error != 0) {
        (void)kill(job->process, SIGKILL);
        (void)waitpid(job->process, NULL, 0);
        (void)fclose(job->output);
        free(job);
        (void)fail(failure, "cannot start a thread: %s", strerror(error));
        return NULL;
    }
    return job;
}

void job_cancel(job_t *job) {
    pthread_mutex_lock(&job->lock);
    if (job->running) {
        (void)kill(job->process, SIGTERM);
    }
    pthread_mutex_unlock(&job->lock);
}

void job_end(job_t *job) {
    if (job != NULL) {
        (void)pthread_join(job->thread, NULL);
        (void)pthread_mutex_destroy(&job->lock);
        free(job);
    }
}
