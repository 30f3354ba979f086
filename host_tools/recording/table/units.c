/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/units.h"
#include <ctype.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

typedef struct {
    const char *text;
    double scale;
    quantity_t quantity;
    bool exact; /* case counts: a prefix */
} unit_t;

static const unit_t units[] = {
    {"s", 1.0, QUANTITY_TIME, true},
    {"ms", 1e-3, QUANTITY_TIME, true},
    {"us", 1e-6, QUANTITY_TIME, true},
    {"\xC2\xB5s", 1e-6, QUANTITY_TIME, true}, /* micro sign */
    {"\xCE\xBCs", 1e-6, QUANTITY_TIME, true}, /* Greek mu */
    {"ns", 1e-9, QUANTITY_TIME, true},
    {"min", 60.0, QUANTITY_TIME, true},
    {"minutes", 60.0, QUANTITY_TIME, false},
    {"hours", 3600.0, QUANTITY_TIME, false},
    {"h", 3600.0, QUANTITY_TIME, true},
    {"hr", 3600.0, QUANTITY_TIME, false},
    {"hrs", 3600.0, QUANTITY_TIME, false},
    {"hour", 3600.0, QUANTITY_TIME, false},
    {"d", 86400.0, QUANTITY_TIME, true},
    {"day", 86400.0, QUANTITY_TIME, false},
    {"days", 86400.0, QUANTITY_TIME, false},
    {"100 ns", 1e-7, QUANTITY_TIME, true}, /* of Windows' clock */
    {"100ns", 1e-7, QUANTITY_TIME, true},
    {"nsec", 1e-9, QUANTITY_TIME, false},
    {"nsecs", 1e-9, QUANTITY_TIME, false},
    {"nanosec", 1e-9, QUANTITY_TIME, false},
    {"hh:mm:ss", 1.0, QUANTITY_TIME, false}, /* a time of day is read as seconds */
    {"hh:mm:ss.s", 1.0, QUANTITY_TIME, false},
    {"hh:mm:ss.sss", 1.0, QUANTITY_TIME, false},
    {"hh:mm:ss.fff", 1.0, QUANTITY_TIME, false},
    {"h:m:s", 1.0, QUANTITY_TIME, false},
    {"UTC", 1.0, QUANTITY_TIME, false},
    {"sec", 1.0, QUANTITY_TIME, false},
    {"secs", 1.0, QUANTITY_TIME, false},
    {"second", 1.0, QUANTITY_TIME, false},
    {"seconds", 1.0, QUANTITY_TIME, false},
    {"sek", 1.0, QUANTITY_TIME, false},
    {"sekunde", 1.0, QUANTITY_TIME, false},
    {"sekunden", 1.0, QUANTITY_TIME, false},
    {"secondes", 1.0, QUANTITY_TIME, false},
    {"msec", 1e-3, QUANTITY_TIME, false},
    {"usec", 1e-6, QUANTITY_TIME, false},
    {"msecs", 1e-3, QUANTITY_TIME, false},
    {"millisecond", 1e-3, QUANTITY_TIME, false},
    {"microsecond", 1e-6, QUANTITY_TIME, false},
    {"nanosecond", 1e-9, QUANTITY_TIME, false},
    {"milliseconds", 1e-3, QUANTITY_TIME, false},
    {"microseconds", 1e-6, QUANTITY_TIME, false},
    {"nanoseconds", 1e-9, QUANTITY_TIME, false},
    {"millis", 1e-3, QUANTITY_TIME, false}, /* what Arduino calls its clocks */
    {"micros", 1e-6, QUANTITY_TIME, false},
    {"v", 1.0, QUANTITY_VOLTAGE, false},
    {"volt", 1.0, QUANTITY_VOLTAGE, false},
    {"volts", 1.0, QUANTITY_VOLTAGE, false},
    {"mv", 1e-3, QUANTITY_VOLTAGE, true},
    {"mV", 1e-3, QUANTITY_VOLTAGE, true},
    {"millivolt", 1e-3, QUANTITY_VOLTAGE, false},
    {"millivolts", 1e-3, QUANTITY_VOLTAGE, false},
    {"mVolt", 1e-3, QUANTITY_VOLTAGE, true},
    {"kilovolts", 1e3, QUANTITY_VOLTAGE, false},
    {"uV", 1e-6, QUANTITY_VOLTAGE, true},
    {"\xC2\xB5V", 1e-6, QUANTITY_VOLTAGE, true},
    {"\xCE\xBCV", 1e-6, QUANTITY_VOLTAGE, true},
    {"kV", 1e3, QUANTITY_VOLTAGE, true},
    {"kilovolt", 1e3, QUANTITY_VOLTAGE, false},
    {"VDC", 1.0, QUANTITY_VOLTAGE, false},
    {"V DC", 1.0, QUANTITY_VOLTAGE, false},
    {"Volt DC", 1.0, QUANTITY_VOLTAGE, false},
    {"mVDC", 1e-3, QUANTITY_VOLTAGE, true},
    {"m", 1e6, QUANTITY_LENGTH, true},
    {"mm", 1e3, QUANTITY_LENGTH, true},
    {"um", 1.0, QUANTITY_LENGTH, false},
    {"\xC2\xB5m", 1.0, QUANTITY_LENGTH, true},
    {"\xCE\xBCm", 1.0, QUANTITY_LENGTH, true},
    {"\xC2\xB5", 1.0, QUANTITY_LENGTH, true},
    {"\xCE\xBC", 1.0, QUANTITY_LENGTH, true},
    {"micron", 1.0, QUANTITY_LENGTH, false},
    {"microns", 1.0, QUANTITY_LENGTH, false},
    {"micrometer", 1.0, QUANTITY_LENGTH, false},
    {"micrometers", 1.0, QUANTITY_LENGTH, false},
    {"micrometres", 1.0, QUANTITY_LENGTH, false},
    {"micrometre", 1.0, QUANTITY_LENGTH, false},
    {"mikrometer", 1.0, QUANTITY_LENGTH, false},
    {"nm", 1e-3, QUANTITY_LENGTH, false},
    {"nanometre", 1e-3, QUANTITY_LENGTH, false},
    {"nanometres", 1e-3, QUANTITY_LENGTH, false},
    {"nanometer", 1e-3, QUANTITY_LENGTH, false},
    {"nanometers", 1e-3, QUANTITY_LENGTH, false},
    {"pm", 1e-6, QUANTITY_LENGTH, true},
    {"mkm", 1.0, QUANTITY_LENGTH, true},       /* Cyrillic letters in Latin ones */
    {"\xC3\x85", 1e-4, QUANTITY_LENGTH, true}, /* A with a ring, as a letter and as a sign */
    {"\xE2\x84\xAB", 1e-4, QUANTITY_LENGTH, true},
    {"angstrom", 1e-4, QUANTITY_LENGTH, false},
    {"angstroms", 1e-4, QUANTITY_LENGTH, false},
    {"\xC3\x85ngstr\xC3\xB6m", 1e-4, QUANTITY_LENGTH, true},
    {"meter", 1e6, QUANTITY_LENGTH, false},
    {"meters", 1e6, QUANTITY_LENGTH, false},
    {"metre", 1e6, QUANTITY_LENGTH, false},
    {"metres", 1e6, QUANTITY_LENGTH, false},
    {"millimeter", 1e3, QUANTITY_LENGTH, false},
    {"millimeters", 1e3, QUANTITY_LENGTH, false},
    {"millimetre", 1e3, QUANTITY_LENGTH, false},
    {"millimetres", 1e3, QUANTITY_LENGTH, false},
    {"picometer", 1e-6, QUANTITY_LENGTH, false},
    {"picometers", 1e-6, QUANTITY_LENGTH, false},
    {"picometre", 1e-6, QUANTITY_LENGTH, false},
    {"picometres", 1e-6, QUANTITY_LENGTH, false},
    {"A", 1.0, QUANTITY_CURRENT, true},
    {"mA", 1e-3, QUANTITY_CURRENT, true},
    {"uA", 1e-6, QUANTITY_CURRENT, true},
    {"ampere", 1.0, QUANTITY_CURRENT, false},
    {"amp", 1.0, QUANTITY_CURRENT, false},
    {"degC", 1.0, QUANTITY_TEMPERATURE, false},
    {"\xC2\xB0"
     "C",
     1.0, QUANTITY_TEMPERATURE, true},
    {"celsius", 1.0, QUANTITY_TEMPERATURE, false},
    {"Hz", 1.0, QUANTITY_FREQUENCY, false},
    {"S/s", 1.0, QUANTITY_FREQUENCY, false},
    {"Sa/s", 1.0, QUANTITY_FREQUENCY, false},
    {"kHz", 1e3, QUANTITY_FREQUENCY, false},
    {"kS/s", 1e3, QUANTITY_FREQUENCY, false},
    {"kSa/s", 1e3, QUANTITY_FREQUENCY, false},
    {"MHz", 1e6, QUANTITY_FREQUENCY, false},
    {"MS/s", 1e6, QUANTITY_FREQUENCY, false},
    {"MSa/s", 1e6, QUANTITY_FREQUENCY, false},
    {"hertz", 1.0, QUANTITY_FREQUENCY, false},
    {"sps", 1.0, QUANTITY_FREQUENCY, false},
    {"ksps", 1e3, QUANTITY_FREQUENCY, false},
    {"Msps", 1e6, QUANTITY_FREQUENCY, false},
    {"samples/s", 1.0, QUANTITY_FREQUENCY, false},
    {"samples/sec", 1.0, QUANTITY_FREQUENCY, false},
    {"samples/second", 1.0, QUANTITY_FREQUENCY, false},
    {"S/sec", 1.0, QUANTITY_FREQUENCY, false},
    {"1/s", 1.0, QUANTITY_FREQUENCY, true},
    /* in one letter as wide as Chinese ones: milli- and microseconds; nm, um, mm; mV, kV */
    {"\xE3\x8E\xB3", 1e-3, QUANTITY_TIME, true},
    {"\xE3\x8E\xB2", 1e-6, QUANTITY_TIME, true},
    {"\xE3\x8E\x9A", 1e-3, QUANTITY_LENGTH, true},
    {"\xE3\x8E\x9B", 1.0, QUANTITY_LENGTH, true},
    {"\xE3\x8E\x9C", 1e3, QUANTITY_LENGTH, true},
    {"\xE3\x8E\xB7", 1e-3, QUANTITY_VOLTAGE, true},
    {"\xE3\x8E\xB8", 1e3, QUANTITY_VOLTAGE, true},
    /* in Cyrillic letters: s, sek, ms, mks, ns; V, mV, kV; m, mm, mkm, nm; mA; Gts, kGts */
    {"\xD1\x81", 1.0, QUANTITY_TIME, true},
    {"\xD1\x81\xD0\xB5\xD0\xBA", 1.0, QUANTITY_TIME, true},
    {"\xD0\xBC\xD1\x81", 1e-3, QUANTITY_TIME, true},
    {"\xD0\xBC\xD0\xBA\xD1\x81", 1e-6, QUANTITY_TIME, true},
    {"\xD0\xBD\xD1\x81", 1e-9, QUANTITY_TIME, true},
    {"\xD0\x92", 1.0, QUANTITY_VOLTAGE, true},
    {"\xD0\xBC\xD0\x92", 1e-3, QUANTITY_VOLTAGE, true},
    {"\xD0\xBA\xD0\x92", 1e3, QUANTITY_VOLTAGE, true},
    {"\xD0\xBC", 1e6, QUANTITY_LENGTH, true},
    {"\xD0\xBC\xD0\xBC", 1e3, QUANTITY_LENGTH, true},
    {"\xD0\xBC\xD0\xBA\xD0\xBC", 1.0, QUANTITY_LENGTH, true},
    {"\xD0\xBD\xD0\xBC", 1e-3, QUANTITY_LENGTH, true},
    {"\xD0\xBC\xD0\x90", 1e-3, QUANTITY_CURRENT, true},
    {"\xD0\x93\xD1\x86", 1.0, QUANTITY_FREQUENCY, true},
    {"\xD0\xBA\xD0\x93\xD1\x86", 1e3, QUANTITY_FREQUENCY, true},
    {"sequence", 1.0, QUANTITY_INDEX, false},
    {"sample", 1.0, QUANTITY_INDEX, false},
    {"samples", 1.0, QUANTITY_INDEX, false},
    {"counts", 1.0, QUANTITY_DIGITS, false},
    {"digits", 1.0, QUANTITY_DIGITS, false},
    {"LSB", 1.0, QUANTITY_DIGITS, false},
    {"%", 1.0, QUANTITY_DIGITS, true}, /* of full scale */
};

quantity_t unit_of(const char *text, double *scale) {
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        if (units[i].exact ? strcmp(text, units[i].text) == 0 : strcasecmp(text, units[i].text) == 0) {
            *scale = units[i].scale;
            return units[i].quantity;
        }
    }
    *scale = 1.0;
    return QUANTITY_UNKNOWN;
}

const char *unit_name(quantity_t quantity) {
    static const char *const names[] = {"", "s", "V", "um", "A", "degC", "Hz", "", ""};
    return names[quantity];
}

static void trim_end(char *text) {
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t_,:", text[length - 1]) != NULL) {
        text[--length] = '\0';
    }
}

/* "A" is a channel's letter more often than a unit, and "h" and "d" are. */
static bool is_letter(const char *name, const char *unit) {
    static const char *const currents[] = {"cur", "strom", "amp"};
    bool current = strcspn(name, " _/") == 1 && tolower((unsigned char)name[0]) == 'i';
    for (size_t i = 0; i < sizeof currents / sizeof currents[0]; i++) {
        current = current || strncasecmp(name, currents[i], strlen(currents[i])) == 0;
    }
    return strcmp(unit, "h") == 0 || strcmp(unit, "d") == 0 || (strcmp(unit, "A") == 0 && !current);
}

/* Brackets somewhere in a name that hold a known unit, "Voltage (V) CH1", or any at its end. Those that are all of it
 * hold a known one. */
static bool take_brackets(char *name, char *unit) {
    for (char *open = name; (open = strpbrk(open, "([{<")) != NULL; open++) {
        const bool known_only = *open == '{' || *open == '<'; /* "101 <Drive>" */
        char *close = strchr(open, *open == '(' ? ')' : *open == '[' ? ']' : *open == '{' ? '}' : '>');
        const char *begin = open + 1 + strspn(open + 1, " ");
        double scale;
        if (close == NULL) {
            continue;
        }
        size_t length = close > begin ? (size_t)(close - begin) : 0;
        while (length > 0 && (begin[length - 1] == ' ' || begin[length - 1] == '.')) {
            length--;
        }
        (void)snprintf(unit, UNIT_FIELD, "%.*s", (int)length, begin);
        const bool index = strspn(unit, "0123456789,:") == strlen(unit); /* "Data(1)" */
        if ((close[1] == '\0' && !index && !known_only && open > name) || unit_of(unit, &scale) != QUANTITY_UNKNOWN) {
            close += (open == name || open[-1] == ' ') && close[1] == ' ' ? 2 : 1;
            memmove(open, close, strlen(close) + 1);
            trim_end(name);
            return true;
        }
    }
    return false;
}

/* The unit behind one of these characters, at the end of a name. */
static void take_end(char *name, char *unit, const char *between) {
    double scale;
    unit[0] = '\0';
    for (; *between != '\0'; between++) {
        char *at = strrchr(name, *between);
        if (at != NULL && at > name && at[1] != '\0' && unit_of(at + 1, &scale) != QUANTITY_UNKNOWN &&
            !is_letter(name, at + 1)) {
            snprintf(unit, UNIT_FIELD, "%s", at + 1);
            *at = '\0';
            trim_end(name);
            if (strlen(name) > 3 && strcmp(name + strlen(name) - 3, " in") == 0) {
                name[strlen(name) - 3] = '\0';
            }
            return;
        }
    }
}

/* The unit at the end of a name before a remark in brackets, which stays: "Position/nm (axis 1)". */
static bool take_before_remark(char *name, char *unit, const char *between) {
    char *const open = strrchr(name, '(') != NULL ? strrchr(name, '(') : strrchr(name, '[');
    double scale;
    if (open == NULL || open == name || open[-1] != ' ') {
        return false;
    }
    (void)snprintf(unit, UNIT_FIELD, "%.*s", (int)strcspn(open + 1, ")]"), open + 1);
    if (unit_of(unit, &scale) != QUANTITY_UNKNOWN) {
        return false;
    }
    open[-1] = '\0';
    take_end(name, unit, between);
    open[-1] = ' ';
    if (unit[0] == '\0') {
        return false;
    }
    const size_t end = strlen(name);
    memmove(name + end, open - 1, strlen(open - 1) + 1);
    return true;
}

/* As R writes "Time (ms)": "Time..ms."; one letter only so. */
static void take_behind_dot(char *name, char *unit) {
    char last[UNIT_FIELD];
    double scale;
    size_t length = strlen(name);
    const bool ends = length > 0 && name[length - 1] == '.';
    while (length > 0 && name[length - 1] == '.') {
        length--;
    }
    size_t begin = length;
    while (begin > 0 && name[begin - 1] != '.') {
        begin--;
    }
    (void)snprintf(last, sizeof last, "%.*s", (int)(length - begin), name + begin);
    if (begin > 1 && (ends || strlen(last) > 1) && unit_of(last, &scale) != QUANTITY_UNKNOWN) {
        (void)snprintf(unit, UNIT_FIELD, "%s", last);
        while (begin > 0 && name[begin - 1] == '.') {
            begin--;
        }
        name[begin] = '\0';
    }
}

/* Behind a small letter, with a capital: "driveMv". */
static void take_behind_capital(char *name, char *unit) {
    static const struct {
        const char *end, *unit;
    } ends[] = {{"Ms", "ms"}, {"Us", "us"}, {"Ns", "ns"}, {"Mv", "mV"}, {"Kv", "kV"},
                {"Mm", "mm"}, {"Um", "um"}, {"Nm", "nm"}, {"Pm", "pm"}};
    const size_t length = strlen(name);
    for (size_t i = 0; length > 3 && i < sizeof ends / sizeof ends[0]; i++) {
        if (strcmp(name + length - 2, ends[i].end) == 0 && islower((unsigned char)name[length - 3]) != 0) {
            (void)snprintf(unit, UNIT_FIELD, "%s", ends[i].unit);
            name[length - 2] = '\0';
            return;
        }
    }
}

void unit_split(char *name, char *unit, const char *between) {
    if (take_before_remark(name, unit, between) || take_brackets(name, unit)) {
        return;
    }
    take_end(name, unit, between);
    if (unit[0] == '\0' && strchr(between, ' ') != NULL) {
        take_behind_dot(name, unit);
    }
    if (unit[0] == '\0') {
        take_behind_capital(name, unit);
    }
}

static const char digits[] = "0123456789";

/* Bytes of a sign of multiplication that a text begins with, 0: none. */
static size_t sign_of_times(const char *text) {
    return strchr("xX*", *text) != NULL && *text != '\0' ? 1 : strncmp(text, "\xC3\x97", 2) == 0 ? 2 : 0;
}

/* Whether a word behind others is a factor: "1:100", "x20", "20x", "*5". "x1" is an axis. */
static bool is_factor(const char *word) {
    const size_t first = strspn(word, digits);
    if (first > 0 && word[first] == ':') {
        const size_t second = strspn(word + first + 1, digits);
        return second > 0 && word[first + 1 + second] == '\0';
    }
    const size_t times = sign_of_times(word + first);
    const size_t second = times > 0 ? strspn(word + first + times, digits) : 0;
    const size_t least = strchr("xX", word[first]) != NULL ? 2 : 1;
    return times > 0 && (first > 0) != (second > 0) && first + second >= least && word[first + times + second] == '\0';
}

/* Whether a word is divided by a number: "V/20". */
static bool is_divided(const char *word) {
    const char *const slash = strchr(word, '/');
    const size_t divisor = slash != NULL ? strspn(slash + 1, digits) : 0;
    return divisor > 0 && slash > word && slash[1 + divisor] == '\0' && strcmp(slash, "/1") != 0;
}

bool unit_states_scale(const char *name, bool divided) {
    for (const char *at = name; *at != '\0';) {
        char word[UNIT_FIELD];
        const size_t length = strcspn(at, " ()[],;_");
        (void)snprintf(word, sizeof word, "%.*s", (int)length, at);
        if (length > 0 && ((at > name && is_factor(word)) || (divided && is_divided(word)))) {
            return true;
        }
        at += length > 0 ? length : 1;
    }
    return false;
}
