/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/decimal.h"
#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Powers of ten that are exact in a double. */
static const double power_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                      1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
enum { MOST_POWER = 22, MOST_DIGITS = 18, LONGEST = 1000 };

static inline bool is_digit(char c) {
    return (unsigned)c - '0' <= 9U;
}

/* By the library, with the decimal point that it knows. */
static bool read_slowly(const char *text, size_t length, char point, double *number) {
    char copy[LONGEST + 1];
    if (length > LONGEST) {
        return false;
    }
    memcpy(copy, text, length);
    copy[length] = '\0';
    if (point != '.') {
        char *comma = strchr(copy, point);
        if (comma != NULL) {
            *comma = '.';
        }
    }
    char *const power = strpbrk(copy, "dD");
    if (power != NULL) {
        *power = 'e';
    }
    *number = strtod(copy, NULL);
    return isfinite(*number);
}

bool decimal_read(const char *text, char point, double *number, const char **end) {
    const char *at = text;
    bool negative = false, fraction = false, any = false;
    uint64_t digits = 0;
    int count = 0, scale = 0, exponent = 0;
    if (*at == '+' || *at == '-') {
        negative = *at++ == '-';
    }
    for (;; at++) {
        if (is_digit(*at)) {
            any = true;
            scale -= fraction;
            digits = count < MOST_DIGITS ? 10 * digits + (uint64_t)(*at - '0') : digits;
            count += count > 0 || *at != '0';
        } else if (*at == point && !fraction) {
            fraction = true;
        } else {
            break;
        }
    }
    if (!any) {
        return false;
    }
    if (*at != '\0' && strchr("eEdD", *at) != NULL) {
        const char *power = at + 1;
        bool below = false;
        if (*power == '+' || *power == '-') {
            below = *power++ == '-';
        }
        if (is_digit(*power)) {
            for (; is_digit(*power); power++) {
                exponent = exponent < 10000 ? 10 * exponent + (*power - '0') : exponent;
            }
            exponent = below ? -exponent : exponent;
            at = power;
        }
    }
    *end = at;
    scale += exponent;
    /* digits < 2^53 and a power of ten that is exact: one rounding, so the nearest double (Clinger 1990). */
    if (count <= MOST_DIGITS && digits < (UINT64_C(1) << 53) && abs(scale) <= MOST_POWER) {
        const double whole = (double)digits;
        const double size = scale < 0 ? whole / power_of_ten[-scale] : whole * power_of_ten[scale];
        *number = negative ? -size : size;
        return true;
    }
    return read_slowly(text, (size_t)(at - text), point, number);
}

bool decimal_is(const char *text, double *number) {
    const char *end;
    return decimal_read(text, '.', number, &end) && *end == '\0';
}

/* From `least` to `most` digits, more behind them not allowed. */
static bool read_digits(const char **at, int least, int most, int *number) {
    int count = 0;
    *number = 0;
    for (; count < most && isdigit((unsigned char)**at); count++, ++*at) {
        *number = 10 * *number + (**at - '0');
    }
    return count >= least && !isdigit((unsigned char)**at);
}

/* Days since 1970 in the Gregorian calendar (Hinnant, days_from_civil). */
static double days_since_1970(int year, int month, int day) {
    const int y = month <= 2 ? year - 1 : year, era = y / 400, of_era = y - era * 400;
    const int of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
    const int days = of_era * 365 + of_era / 4 - of_era / 100 + of_year;
    return (double)era * 146097.0 + (double)days - 719468.0;
}

/* The number of a month that begins with three letters, English or German, 0: none; *at is behind the word. */
static int read_month(const char **at) {
    static const char *const names[] = {"jan", "feb", "mar", "apr", "may", "jun", "jul", "aug",
                                        "sep", "oct", "nov", "dec", "mai", "okt", "dez"};
    static const int numbers[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 5, 10, 12};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strncasecmp(*at, names[i], 3) == 0) {
            *at += 3;
            while (isalpha((unsigned char)**at)) {
                ++*at;
            }
            return numbers[i];
        }
    }
    return 0;
}

/* A date with the month in letters, and what stands behind it: 29-Nov-2026, 29 Nov 2026. */
static bool read_named_date(const char **at, double *days) {
    const char *text = *at;
    int day, year;
    if (!read_digits(&text, 1, 2, &day) || *text == '\0' || strchr("- ", *text) == NULL) {
        return false;
    }
    const char between = *text++;
    const int month = read_month(&text);
    if (month == 0 || *text++ != between || !read_digits(&text, 4, 4, &year) || *text != ' ' || day < 1 || day > 31) {
        return false;
    }
    *days = days_since_1970(year, month, day);
    *at = text + 1;
    return true;
}

/* A date and a blank or 'T' behind it: 2026-11-23, 2026/11/23, 23.11.2026; or 23/11/2026, of which day and month are
 * not told apart: *days is then 0. false: there is none, *at stays. */
static bool read_date(const char **at, double *days) {
    const char *text = *at;
    int first, month, last;
    if (read_named_date(at, days)) {
        return true;
    }
    if (!read_digits(&text, 1, 4, &first) || strchr("-/.", *text) == NULL || *text == '\0') {
        return false;
    }
    const size_t digits = (size_t)(text - *at);
    const char between = *text++;
    if (!read_digits(&text, 1, 2, &month) || *text++ != between || !read_digits(&text, 1, 4, &last) ||
        (*text != ' ' && *text != 'T')) {
        return false;
    }
    const int year = digits == 4 ? first : last, day = digits == 4 ? last : first;
    if (year < 1000 || month < 1 || day < 1 || day > 31 || (month > 12 && between != '/')) {
        return false;
    }
    *days = digits == 4 || between == '.' ? days_since_1970(year, month, day) : 0.0;
    *at = text + 1;
    return digits == 4 ? between != '.' && month <= 12 : between != '-';
}

/* "0 days " before a time of day, as pandas writes a time difference. */
static void read_days(const char **at, double *days) {
    const char *text = *at;
    int count;
    if (read_digits(&text, 1, 5, &count) && (strncmp(text, " days ", 6) == 0 || strncmp(text, " day ", 5) == 0)) {
        *days = (double)count;
        *at = strchr(text + 1, ' ') + 1;
    }
}

/* "PM" behind a time of day, and a time zone, which is the same for all of a file. */
static int read_half_and_zone(const char **at, int hour) {
    const char *text = *at + strspn(*at, " ");
    const char half = (char)tolower((unsigned char)*text);
    if ((half == 'a' || half == 'p') && tolower((unsigned char)text[1]) == 'm' && hour <= 12) {
        hour = hour % 12 + (half == 'p' ? 12 : 0);
        *at = text + 2;
    }
    if (**at == 'Z') {
        ++*at;
    } else if ((**at == '+' || **at == '-') && isdigit((unsigned char)(*at)[1])) {
        ++*at;
        *at += strspn(*at, "0123456789:");
    }
    return hour;
}

bool clock_read(const char *text, size_t length, double *seconds, const char **end) {
    int hour, minute, second;
    double days = 0.0, fraction = 0.0;
    const char *at = text;
    if (!read_date(&at, &days) && at == text) {
        read_days(&at, &days);
    }
    if (!read_digits(&at, 1, 2, &hour) || *at++ != ':' || !read_digits(&at, 2, 2, &minute)) {
        return false;
    }
    const bool short_one = *at == '.' || *at == ','; /* "12:30.5" are minutes and seconds */
    if (short_one) {
        second = minute;
        minute = hour;
        hour = 0;
    } else if (*at++ != ':' || !read_digits(&at, 1, 2, &second)) {
        return false;
    }
    if (hour > 23 || minute > 59 || second > 60) {
        return false;
    }
    const bool colon = *at == ':' && strspn(at + 1, "0123456789") == 3 && !short_one; /* "10:11:12:345" */
    if (at < text + length && (*at == '.' || *at == ',' || colon) && isdigit((unsigned char)at[1])) {
        double place = 0.1;
        for (at++; isdigit((unsigned char)*at); at++) {
            fraction += place * (double)(*at - '0');
            place /= 10.0;
        }
    } else if (short_one) {
        return false;
    }
    hour = read_half_and_zone(&at, hour);
    *end = at;
    *seconds = 86400.0 * days + 3600.0 * (double)hour + 60.0 * (double)minute + (double)second + fraction;
    return true;
}
