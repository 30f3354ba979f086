/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A signal that ends a program in the middle of writing leaves the previous file and nothing beside it. */
#include "base/output_file.h"
#include "command_line/ending_signals.h"
#include "unity.h"
#include <dirent.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[32];
static char path[sizeof folder + 8];

static const int ending[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};

void setUp(void) {
    (void)snprintf(folder, sizeof folder, "output-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    (void)snprintf(path, sizeof path, "%s/file", folder);
}

static void remove_all(void) {
    DIR *opened = opendir(folder);
    for (const struct dirent *entry; (entry = readdir(opened)) != NULL;) {
        (void)unlinkat(dirfd(opened), entry->d_name, 0);
    }
    (void)closedir(opened);
    (void)rmdir(folder);
}

void tearDown(void) {
    remove_all();
}

static size_t parts(void) {
    size_t found = 0;
    DIR *opened = opendir(folder);
    for (const struct dirent *entry; (entry = readdir(opened)) != NULL;) {
        found += strstr(entry->d_name, ".part") != NULL;
    }
    (void)closedir(opened);
    return found;
}

static void write_text(output_file_t *output, const char *text) {
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(output_file_open(output, path, &failure), failure.text);
    (void)fputs(text, output->file);
    (void)fflush(output->file);
}

static void assert_file(const char *text) {
    char found[16] = "";
    FILE *file = fopen(path, "r");
    TEST_ASSERT_NOT_NULL(file);
    found[fread(found, 1, sizeof found - 1, file)] = '\0';
    (void)fclose(file);
    TEST_ASSERT_EQUAL_STRING(text, found);
}

static void write_whole(const char *text) {
    output_file_t output;
    failure_t failure = {{0}};
    write_text(&output, text);
    TEST_ASSERT_TRUE_MESSAGE(output_file_close(&output, true, &failure), failure.text);
}

/* A child that writes half a file, after some whole ones, and gets the signal. */
static int end_by(int number) {
    const pid_t child = fork();
    if (child == 0) {
        ending_signals_remove_parts();
        for (int i = 0; i < 10; i++) { /* more than are known at a time */
            write_whole("second");
        }
        output_file_t output;
        write_text(&output, "half");
        (void)raise(number);
        _exit(parts() == 1 ? 0 : 1);
    }
    int status = 0;
    TEST_ASSERT_EQUAL(child, waitpid(child, &status, 0));
    return status;
}

static void test_signals_leave_no_part(void) {
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++) {
        write_whole("first");
        const int status = end_by(ending[i]);
        TEST_ASSERT_TRUE(WIFSIGNALED(status));
        TEST_ASSERT_EQUAL(ending[i], WTERMSIG(status));
        TEST_ASSERT_EQUAL(0, parts());
        assert_file("second");
    }
}

/* As under nohup: the program goes on, and so does its file. */
static void test_ignored_signal_stays_ignored(void) {
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++) {
        void (*const before)(int) = signal(ending[i], SIG_IGN);
        const int status = end_by(ending[i]);
        (void)signal(ending[i], before);
        TEST_ASSERT_TRUE(WIFEXITED(status));
        TEST_ASSERT_EQUAL(0, WEXITSTATUS(status));
        remove_all();
        setUp();
    }
}

/* A part that a killed process of the same number left belongs to no one here. */
static void test_another_part_is_left_alone(void) {
    const pid_t child = fork();
    if (child == 0) {
        char other[sizeof folder + 64];
        (void)snprintf(other, sizeof other, "%s/.hyst-%ld-0.part", folder, (long)getpid());
        FILE *file = fopen(other, "w");
        output_file_t output;
        ending_signals_remove_parts();
        write_text(&output, "half");
        (void)fclose(file);
        (void)raise(SIGTERM);
        _exit(1);
    }
    int status = 0;
    TEST_ASSERT_EQUAL(child, waitpid(child, &status, 0));
    TEST_ASSERT_TRUE(WIFSIGNALED(status));
    TEST_ASSERT_EQUAL(1, parts());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_signals_leave_no_part);
    RUN_TEST(test_ignored_signal_stays_ignored);
    RUN_TEST(test_another_part_is_left_alone);
    return UNITY_END();
}
