/* SPDX-License-Identifier: MIT */
/**
 * The register table (registers.def) as C: constants for code that knows the names at compile time, and a table with
 * names, units and texts for code that looks registers up or prints them (host tool, docs/REGISTERS.md).
 *
 * The table itself is in register_table.c and is linked only where it is used: not into the firmware.
 */
#ifndef REGISTER_TABLE_H
#define REGISTER_TABLE_H

#include <stddef.h>
#include <stdint.h>

/** Value of the register `magic`, "HY". */
#define REGISTERS_MAGIC 0x4859U

/** How the bits are to be read. All types but U16, ENUM and BITS take two registers, high word first. */
typedef enum {
    REGISTER_U16,
    REGISTER_ENUM,
    REGISTER_BITS,
    REGISTER_U32,
    REGISTER_S32,
    REGISTER_Q31, /**< S32, worth integer / 2^31 */
    REGISTER_Q28  /**< S32, worth integer / 2^28 */
} register_type_t;

typedef enum { REGISTER_RO, REGISTER_RW, REGISTER_WO } register_access_t;

/** Registers that a value of this type takes: 1 or 2. */
#define REGISTER_SIZE(type) ((type) < REGISTER_U32 ? 1U : 2U)

/** ADDRESS_<name> of every register and block. */
enum {
#define REGISTER(name, address, type, access, unit, text) ADDRESS_##name = (address),
#define BLOCK(name, address, registers, access, text)     ADDRESS_##name = (address),
#include "registers/registers.def"
};

/** INDEX_<name>: the place of a register in the order of registers.def, which is the order of addresses. */
enum {
#define REGISTER(name, address, type, access, unit, text) INDEX_##name,
#include "registers/registers.def"
    REGISTER_COUNT
};

/** LENGTH_<name> of every block, in registers. */
enum {
#define BLOCK(name, address, registers, access, text) LENGTH_##name = (registers),
#include "registers/registers.def"
};

typedef struct {
    const char *name;
    uint16_t address;
    register_type_t type;
    register_access_t access;
    const char *unit; /**< "" for none */
    const char *text;
} register_info_t;

typedef struct {
    const char *name;
    uint16_t address;
    uint16_t registers;
    register_access_t access;
    const char *text;
} register_block_info_t;

/** In the order of addresses. */
extern const register_info_t register_table[REGISTER_COUNT];
extern const register_block_info_t register_blocks[];
extern const size_t register_block_count;

/** Look up by name. NULL if there is none. */
const register_info_t *register_find(const char *name);
const register_block_info_t *register_find_block(const char *name);

/** What a value of register `board` is called (firmware/boards), or NULL. */
const char *board_name(int64_t id);

#endif
