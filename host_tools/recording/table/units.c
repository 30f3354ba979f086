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
    {"meter", 1e6, QUANTITY_LENGTH, false},
    {"meters", 1e6, QUANTITY_LENGTH, false},
    {"millimeter", 1e3, QUANTITY_LENGTH, false},
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

/* "A" is a channel's letter more often than a unit. */
static bool is_letter(const char *name, const char *unit) {
    static const char *const currents[] = {"cur", "strom", "amp"};
    bool current = strcspn(name, " _/") == 1 && tolower((unsigned char)name[0]) == 'i';
    for (size_t i = 0; i < sizeof currents / sizeof currents[0]; i++) {
        current = current || strncasecmp(name, currents[i], strlen(currents[i])) == 0;
    }
    return strcmp(unit, "A") == 0 && !current;
}

/* Brackets somewhere in a name that hold a known unit, "Voltage (V) CH1", or any at its end. Those that are all of it
 * hold a known one. */
static bool take_brackets(char *name, char *unit) {
    for (char *open = name; (open = strpbrk(open, "([")) != NULL; open++) {
        char *close = strchr(open, *open == '(' ? ')' : ']');
        const char *begin = open + 1 + strspn(open + 1, " ");
        double scale;
        if (close == NULL) {
            return false;
        }
        size_t length = close > begin ? (size_t)(close - begin) : 0;
        while (length > 0 && (begin[length - 1] == ' ' || begin[length - 1] == '.')) {
            length--;
        }
        (void)snprintf(unit, UNIT_FIELD, "%.*s", (int)length, begin);
        const bool index = strspn(unit, "0123456789,:") == strlen(unit); /* "Data(1)" */
        if ((close[1] == '\0' && !index && open > name) || unit_of(unit, &scale) != QUANTITY_UNKNOWN) {
            close += (open == name || open[-1] == ' ') && close[1] == ' ' ? 2 : 1;
            memmove(open, close, strlen(close) + 1);
            trim_end(name);
            return true;
        }
    }
    return false;
}

void unit_split(char *name, char *unit, const char *between) {
    double scale;
    if (take_brackets(name, unit)) {
        return;
    }
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
