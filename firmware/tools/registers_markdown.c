/* SPDX-License-Identifier: MIT */
/*
 * Writes docs/REGISTERS.md to standard output. What is in a table of the program is printed from it; the prose around
 * it is here.
 */
#include "hyst/parameters.h"
#include "loop/loop.h"
#include "modbus/modbus_server.h"
#include "protection/health_watch.h"
#include "registers/control.h"
#include "registers/register_table.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static const char *type_text(register_type_t type) {
    static const char *const texts[] = {
        [REGISTER_U16] = "U16", [REGISTER_ENUM] = "ENUM", [REGISTER_BITS] = "BITS", [REGISTER_U32] = "U32",
        [REGISTER_S32] = "S32", [REGISTER_Q31] = "Q31",   [REGISTER_Q28] = "Q28",
    };
    return texts[type];
}

static const char *access_text(register_access_t access) {
    static const char *const texts[] = {[REGISTER_RO] = "read", [REGISTER_RW] = "read, write", [REGISTER_WO] = "write"};
    return texts[access];
}

static void print_introduction(void) {
    const line_settings_t as_delivered = LINE_SETTINGS_DEFAULT;
    printf(
        "<!-- Written by firmware/tools/registers_markdown.c from firmware/app/registers/registers.def; "
        "`cmake --build` target `registers_markdown_update` renews it. -->\n"
        "# Registers\n\n"
        "Everything the amplifier does can be done by any Modbus RTU master, with this page alone.\n\n"
        "## The line\n\n"
        "Modbus RTU, 8 data bits, 1 stop bit; as delivered server address %u, %u baud, no parity (`line_address` and "
        "following). A silence of 3.5 characters, above 19200 baud of 1.75 ms, ends a frame, and a pause of 1.5 (0.75 "
        "ms) does not, as the standard has it. A pause between these is not held against a frame up to some 2.5 "
        "characters (1.5 ms on h405). A longer one cuts it, and neither part is answered.\n\n"
        "| function | what | most registers |\n|---|---|---|\n"
        "| 3, 4 | read registers; both read this one map | %u |\n"
        "| 1, 2 | read coils, discrete inputs | 1, 69 bits |\n"
        "| 5, 15 | write the coil: armed | 1 bit |\n"
        "| 6 | write one register | 1 |\n"
        "| 8 | diagnostics: 0 query data, 10 clear counters, 12 errors, 14 messages | |\n"
        "| 22 | mask write of one register | 1 |\n"
        "| 16 | write registers | %u |\n"
        "| 23 | write, then read | %u, %u |\n"
        "| 43/14 | device identification: vendor, product, revision; object 128, the serial number | |\n\n"
        "A request succeeds or fails as a whole: one that is refused has changed nothing.\n\n"
        "A request to address %u is for every amplifier of the line and is not answered. It may write what makes the "
        "output safe, or what moves nothing and protects nothing: the commands %u (nothing), %u (stop, also out of a "
        "fault), %u (clear; with the parameters unlocked), %u (park), %u (latch: one instant for all) and %u "
        "(disarm), mode 0, the coil off, and 0 to `unlock`. All else is refused (`write_refused` %u), whatever is "
        "unlocked, and one such register refuses the whole request: what starts, arms, changes or stores is for one "
        "amplifier, and answered. Functions that read are ignored at this address.\n\n"
        "Several amplifiers share a line when each has an address of its own. All are delivered with the same one: set "
        "them one at a time, with no other on the line (`line_address`, then command %u). Each hears what the others "
        "answer and acts on none of it, as long as masters leave a silence between an answer and the next request. "
        "Give each a communication timeout that is longer than a whole turn of requests.\n\n"
        "| exception | meaning here |\n|---|---|\n"
        "| 1 | unknown function |\n"
        "| 2 | a register that does not exist, or is read only, or half of a two-register value |\n"
        "| 3 | a value out of range, a command that is unknown or not possible now, or a malformed request |\n"
        "| 4 | legal, but not now: the capture is being filled, the table is being played, or a lock is on (`unlock`) "
        "|\n\n",
        (unsigned)as_delivered.address, (unsigned)as_delivered.baud, MODBUS_READ_MAX, MODBUS_WRITE_MAX,
        MODBUS_READ_WRITE_MAX, MODBUS_READ_MAX, MODBUS_BROADCAST_ADDRESS, (unsigned)COMMAND_NONE,
        (unsigned)COMMAND_STOP, (unsigned)COMMAND_CLEAR, (unsigned)COMMAND_PARK, (unsigned)COMMAND_LATCH,
        (unsigned)COMMAND_DISARM, (unsigned)WRITE_BROADCAST, (unsigned)COMMAND_SAVE_LINE);
}

static void print_numbers(void) {
    printf("## Numbers\n\n"
           "Addresses count from 0, as in the frame. (Masters that count from 1 add one.) U16, ENUM and BITS take one "
           "register. U32, S32, Q31 and Q28 take two, **high word first**, and are written only whole.\n\n"
           "* Q31 is a signed fraction of full scale: integer / 2^31, from -1 up to just below 1. 0.25 is 536870912 = "
           "0x20000000.\n"
           "* Q28 likewise: integer / 2^28, from -8 to 8.\n\n"
           "Drive and position are fractions of their converter's half range around its middle. What that is in volts "
           "and micrometres only the image in force says, in its words 5 to 8: drive in microvolts = word 5 + word 6 * "
           "fraction, position in picometres = word 7 + word 8 * fraction.\n\n"
           "A client reads `magic` and `abi` first and stops at a number it does not know. What makes safe it may "
           "write all\n"
           "the same: `magic`, `abi` and `command` keep their addresses in every version of the map, and the commands "
           "3 (stop),\n"
           "7 (park) and, from version 2 on, 10 (disarm) their meaning.\n\n");
}

static void print_registers(uint16_t from, uint32_t to) {
    printf("| address | decimal | name | type | access | unit | |\n|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < REGISTER_COUNT; i++) {
        const register_info_t *info = &register_table[i];
        if (info->address >= from && info->address < to) {
            printf("| 0x%04X | %u | `%s` | %s | %s | %s | %s |\n", info->address, info->address, info->name,
                   type_text(info->type), access_text(info->access), info->unit, info->text);
        }
    }
    printf("\n");
}

static void print_table(void) {
    printf("## Identity\n\n");
    print_registers(ADDRESS_magic, ADDRESS_command);
    printf("## Control\n\n");
    print_registers(ADDRESS_command, ADDRESS_fault_code);
    printf("## Parameters: result of the last commit\n\n");
    print_registers(ADDRESS_fault_code, ADDRESS_sequence);
    printf("## Telemetry\n\n"
           "All values are of one sample. Reading `sequence` (or command 8) takes a new snapshot; the other registers "
           "read from the snapshot until then. So a request over the whole block is consistent, and so is reading "
           "`sequence` first and the rest piece by piece. Reading others alone shows an old snapshot. Counters "
           "saturate.\n\n");
    print_registers(ADDRESS_sequence, ADDRESS_reset_cause);
    printf("## Start\n\n");
    print_registers(ADDRESS_reset_cause, ADDRESS_line_address);
    printf("## Settings of the line\n\n"
           "Write the three, then command 13, with the parameters unlocked and the amplifier off. The answer to that "
           "request comes as before; from then on the line has the new settings. Whether they were stored is in "
           "`store_state` (3). They are stored beside the image, in one copy: a supply that goes meanwhile leaves both "
           "as they were, or the new settings with the same image. A board may have a way to start with the default "
           "ones (h405: PA0 high, docs/WIRING.md).\n\n");
    print_registers(ADDRESS_line_address, ADDRESS_tones);
    printf("## Blocks\n\n"
           "A request that starts in a block must end in it.\n\n"
           "| address | decimal | registers | name | access | |\n|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < register_block_count; i++) {
        const register_block_info_t *block = &register_blocks[i];
        printf("| 0x%04X | %u | %u | `%s` | %s | %s |\n", block->address, block->address, block->registers, block->name,
               access_text(block->access), block->text);
    }
    printf("\n");
}

static void print_duties(void) {
    printf(
        "## What a master must do\n\n"
        "The amplifier starts off: stage disabled, parked at the stored image's drive_park or, without one, at the "
        "safe code of its board, without limits. To move "
        "something:\n\n"
        "1. Unlock what it means to write (`unlock`): after a start the amplifier can be read and stopped, no more.\n"
        "2. Commit an image (`staging`, command 1). The output ramps to its `drive_park`.\n"
        "3. Arm (command 9) and read `amplifier_state` until it is 3, hold: precharge takes %u ms, and longer, at "
        "most %u ms, while the self test at its end fails.\n"
        "4. Write a `setpoint`, then a `mode`: the output goes there from where it rests. A mode alone moves nothing. "
        "Start a source, condition.\n"
        "5. Go on talking. Outside of park some request has to be accepted within `watchdog` milliseconds, %u unless "
        "it is set; the sample interrupt counts them, in periods, missed ones too.\n"
        "6. Disarm (command 10): ramp to park, then off.\n\n"
        "A mode that follows on park begins with the reference that belongs to where the output rests: in direct mode "
        "that drive, in linear mode what makes it, in compensate mode the position that the model has there. If none "
        "was written, that is the `setpoint`, too. Where `reference_low`, `reference_high` or full scale do not have "
        "it, the nearest one is taken, and the output goes there by `transition_slew`. A mode that is taken while the "
        "output is on its way to park holds it where it is; in precharge and while conditioning it begins at park. A "
        "setpoint from before a fault, a parking, a disarming or a command 3 is none any more.\n\n"
        "After a fault that trips, `amplifier_state` is 6: the output ramps to park, beginning with the sample in "
        "which the fault is found, and the stage is disabled there. The ramp is as fast as `transition_slew`, and no "
        "slower than the board wants (half a second for the whole range): so the output is safe half a second after a "
        "fault is found, at the latest. A stage that was off stays off. `trip_cause` says why. Command 3 "
        "leads "
        "out of it, to off; nothing else does, and nothing arms by itself.\n\n"
        "| fault that trips | found | reaction |\n|---|---|---|\n"
        "| communication timeout | in the sample after `watchdog` milliseconds | ramp from that sample on |\n"
        "| overload | in the %uth late sample in a row | the same, and the compensator no longer runs: its memory is "
        "lost "
        "(`limits_live` 16), so condition the actuator afterwards |\n"
        "| supply too low | in the next sample | ramp from that sample on |\n"
        "| temperature, supply or the stage's supply outside of its limits (where the board measures them) | in the "
        "`health_looks`th look outside in a row, one each %u samples | the same. Arming is refused (exception 3) while "
        "it lasts |\n"
        "| a supply or the temperature is outside of its limits at the end of precharge | %u ms after the output rests "
        "| "
        "the stage is disabled; the drive has not left park |\n"
        "| the image in force is not what was committed: its coefficients in memory have changed | when it is armed, "
        "and within %u ms while it runs (calculated; 600 ms at 9600 baud, while a master reads without a pause) | the "
        "stage is not enabled, or ramp without the compensator; push "
        "the image again |\n"
        "| the main loop stands still | after %u ms | ramp from that sample on; then the hardware watchdog restarts, "
        "`reset_cause` 4 |\n"
        "| the drive's converter does not hold what it was given | in the `health_looks`th look in a row | ramp, as "
        "far as it goes; the stage is disabled |\n"
        "| processor fault | at once | ramp to the parking code within 50 ms (0.5 s without the PLL), stage off, "
        "restart; "
        "`reset_cause` 16 |\n"
        "| the sample interrupt stands still | within 1.9 s, by the hardware watchdog | restart, stage off; "
        "`reset_cause` 4 |\n\n"
        "`reset_cause` and `starts` tell a master that the amplifier has started anew. What it had set and not stored "
        "is gone, locks and the communication timeout are on.\n\n",
        POWER_PRECHARGE_MS, POWER_SELF_TEST_MS, LOOP_DEFAULT_TIMEOUT_MS, LOOP_OVERRUNS_TO_TRIP, HEALTH_WATCH_TURN,
        POWER_SELF_TEST_MS, 500U, HEALTH_WATCH_STALL_MS);
}

static void print_store(void) {
    printf("## What a start finds\n\n"
           "Command 11 stores the image in force, and with it the limits that a lab sets once for its stack: "
           "`setpoint_slew`, `model_error_limit`, `model_error_time`, `current_limit`, `drive_low`, `drive_high`, "
           "`reference_low`, `reference_high`, `reference_slew`, `temperature_alert`, `temperature_trip`, "
           "`supply_low`, `supply_high`, `high_voltage_low`, `high_voltage_high`, `health_looks` and `capacitance`. "
           "Only while off "
           "and parked: an h405 stands still for up to 0.5 s then. The next start has all of it in force and begins at "
           "the image's `drive_park`. Where an image or one of its limits is refused at start (`store_state` 2), none "
           "of the limits is in force, and the amplifier cannot be armed before another image is committed. The values "
           "\"after start\" below are those of an amplifier that has nothing stored.\n\n"
           "The communication timeout is not stored, nor are the locks: a start has both.\n\n"
           "Two flash sectors are written in turn: a supply that goes meanwhile leaves what was there before or the "
           "new copy, whole. They wear after 20,000 saves.\n\n");
}

static void print_faults(void) {
    printf("## Why an image is refused\n\n"
           "The layout of an image is in `lib/hyst/include/hyst/parameters.h`.\n\n"
           "| `fault_code` | |\n|---|---|\n");
    for (int error = HYST_PARAMETERS_OK; error < HYST_PARAMETERS_ERROR_COUNT; error++) {
        printf("| %d | %s |\n", error, hyst_parameters_error_text((hyst_parameters_error_t)error));
    }
    printf("\n| `fault_field` | field of the image |\n|---|---|\n");
    for (int field = HYST_FIELD_NONE; field < HYST_FIELD_COUNT; field++) {
        printf("| %d | %s |\n", field, hyst_field_text((hyst_field_t)field));
    }
    printf(
        "\nAn image for another sample rate than `sample_rate` is refused with %d at field %d. One that asks for more "
        "than the board allows is refused with %d: a transition_slew that crosses the whole range in less than 10 ms "
        "or more than 10 s, a cascade of filters (shape, inertia, equalise) that can amplify more than 64 times. New "
        "limits that exclude the present drive are reached by a ramp of transition_slew.\n\n",
        HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_SAMPLE_RATE, HYST_PARAMETERS_OUT_OF_RANGE);
}

/* The head of every example; LINE stands for the serial port. */
#define MBPOLL "mbpoll -m rtu -a 1 -b 115200 -P none -0 -1 "

static void print_examples(void) {
    printf(
        "## Examples with mbpoll\n\n"
        "`-0` counts addresses from 0, `-t 4:int -B` reads and writes two-register values high word first. `$LINE` is "
        "the serial port.\n\n");
    printf("Is it an amplifier (0x4859), and which register map?\n\n"
           "    " MBPOLL "-r %d -c 2 -t 4:hex $LINE\n\n",
           ADDRESS_magic);
    printf("One consistent snapshot of telemetry, all in one request:\n\n"
           "    " MBPOLL "-r %d -c %d -t 4:hex $LINE\n\n",
           ADDRESS_sequence, ADDRESS_frames_served + 1 - ADDRESS_sequence);
    printf("Reference, drive and position of that snapshot as integers (divide by 2147483648):\n\n"
           "    " MBPOLL "-r %d -c 3 -t 4:int -B $LINE\n\n",
           ADDRESS_reference);
}

static void print_motion_examples(void) {
    printf(
        "Off, on and out of a fault: by hand the communication timeout has to go first (`watchdog` 0), then command 9 "
        "arms; precharge takes 0.1 s.\n\n"
        "    " MBPOLL "-r %d -t 4 $LINE 0\n"
        "    " MBPOLL "-r %d -t 4 $LINE 9\n\n",
        ADDRESS_watchdog, ADDRESS_command);
    printf("A setpoint of a quarter of full scale, then linear mode:\n\n"
           "    " MBPOLL "-r %d -t 4:int -B $LINE 536870912\n"
           "    " MBPOLL "-r %d -t 4 $LINE 2\n\n",
           ADDRESS_setpoint, ADDRESS_mode);
    printf("A sine of 10 Hz around 0, a tenth of full scale, without end (10 Hz * 2^32 / 10 kHz = 4294967). Offset, "
           "amplitude, increment and cycles follow each other, so one request sets them; the kind and the start are "
           "one each:\n\n"
           "    " MBPOLL "-r %d -t 4:int -B $LINE 0 214748365 4294967 0\n"
           "    " MBPOLL "-r %d -t 4 $LINE 1\n"
           "    " MBPOLL "-r %d -t 4 $LINE 2\n\n",
           ADDRESS_source_offset, ADDRESS_source, ADDRESS_command);
    printf("The same with 10 for the 2 disarms: ramp to park, then off.\n");
}

static void print_commit_example(void) {
    hyst_parameters_t parameters;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_default(&parameters);
    const size_t count = hyst_parameters_encode(&parameters, words, HYST_IMAGE_MAX_WORDS);
    printf("Unlocking the parameters, and the output:\n\n"
           "    " MBPOLL "-r %d -t 4 $LINE %d\n"
           "    " MBPOLL "-r %d -t 4 $LINE %d\n\n",
           ADDRESS_unlock, CONTROL_KEY_PARAMETERS, ADDRESS_unlock, CONTROL_KEY_OUTPUT);
    printf("Putting an image in force: write its words to `staging`, commit, look at the result (`fault_code`, 0 is "
           "accepted). This one has no hysteresis, gain 1, the whole range, and parks in its middle, for 10 kHz; "
           "mbpoll takes 32-bit numbers as signed ones. A longer image "
           "needs several requests, %u words each at the most:\n\n"
           "    " MBPOLL "-r %d -t 4:int -B $LINE --",
           MODBUS_WRITE_MAX / 2U, ADDRESS_staging);
    for (size_t i = 0; i < count; i++) {
        printf(" %" PRId32, (int32_t)words[i]);
    }
    printf("\n"
           "    " MBPOLL "-r %d -t 4 $LINE 1\n"
           "    " MBPOLL "-r %d -c 3 -t 4 $LINE\n\n",
           ADDRESS_command, ADDRESS_fault_code);
}

int main(void) {
    print_introduction();
    print_numbers();
    print_duties();
    print_store();
    print_table();
    print_faults();
    print_examples();
    print_commit_example();
    print_motion_examples();
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
