/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "peripheral_log.h"
#include "base/monotonic_clock.h"
#include <limits.h>
#include <stdlib.h>
#include <string.h>

/* Addresses within the peripherals (RM0090), and the value that sets pin 5 of port B. */
enum { DAC_CR = 0x00, DAC_DHR12L1 = 0x0C, GPIO_BSRR = 0x18, DRIVER_ENABLE = 1 << 5, IWDG_KR = 0x00, FOOD = 0xAAAA };

/* The number behind `label`, or ULONG_MAX. */
static unsigned long number_behind(const char *line, const char *label) {
    const char *at = strstr(line, label);
    return at != NULL ? strtoul(at + strlen(label), NULL, 16) : ULONG_MAX;
}

static bool begins(const char *line, const char *with) {
    return strncmp(line, with, strlen(with)) == 0;
}

/* QEMU 7.2 has the watchdog twice, the second time under the name of what lies above it. */
static void take_line(peripheral_log_t *log) {
    const unsigned long offset = number_behind(log->line, "device write (size 4, offset 0x");
    const unsigned long value = number_behind(log->line, "value 0x");
    const bool converter = begins(log->line, "DAC:");
    if (converter && offset == DAC_DHR12L1 && log->codes < PERIPHERAL_LOG_CODES) {
        log->code[log->codes++] = (uint16_t)value;
    } else if (converter && offset == DAC_CR && log->controls < sizeof log->control / sizeof log->control[0]) {
        log->codes_at_control[log->controls] = log->codes;
        log->control[log->controls++] = (uint32_t)value;
    } else if (begins(log->line, "GPIOB:") && offset == GPIO_BSRR && value == DRIVER_ENABLE) {
        log->codes_at_answer = log->codes;
        log->answers++;
    } else if ((begins(log->line, "IWDG:") || begins(log->line, "I2S2ext:")) && offset == IWDG_KR && value == FOOD &&
               log->codes_at_food[log->controls] == 0) {
        log->codes_at_food[log->controls] = log->codes;
    }
}

bool peripheral_log_open(peripheral_log_t *log, const char *path) {
    memset(log, 0, sizeof *log);
    log->file = fopen(path, "r");
    return log->file != NULL;
}

void peripheral_log_read(peripheral_log_t *log) {
    clearerr(log->file);
    /* A line may be only half there: the rest comes next time. */
    for (int c = getc(log->file); c != EOF; c = getc(log->file)) {
        if (c == '\n') {
            log->line[log->line_length] = '\0';
            take_line(log);
            log->line_length = 0;
        } else if (log->line_length < sizeof log->line - 1) {
            log->line[log->line_length++] = (char)c;
        }
    }
}

static bool wait_for(peripheral_log_t *log, const size_t *count, size_t wanted, double seconds) {
    const double until_s = monotonic_s() + seconds;
    peripheral_log_read(log);
    while (*count < wanted && monotonic_s() < until_s) {
        sleep_until(monotonic_s() + 0.005);
        peripheral_log_read(log);
    }
    return *count >= wanted;
}

bool peripheral_log_wait(peripheral_log_t *log, size_t codes, double seconds) {
    return wait_for(log, &log->codes, codes, seconds);
}

bool peripheral_log_wait_for_control(peripheral_log_t *log, size_t controls, double seconds) {
    return wait_for(log, &log->controls, controls, seconds);
}

void peripheral_log_close(peripheral_log_t *log) {
    if (log->file != NULL) {
        (void)fclose(log->file);
        log->file = NULL;
    }
}
