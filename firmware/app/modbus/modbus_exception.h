/* SPDX-License-Identifier: MIT */
/** Exception codes of the Modbus application protocol (V1.1b3, section 7) that this server uses. */
#ifndef MODBUS_EXCEPTION_H
#define MODBUS_EXCEPTION_H

typedef enum {
    MODBUS_OK = 0,
    MODBUS_ILLEGAL_FUNCTION = 1,
    MODBUS_ILLEGAL_ADDRESS = 2, /**< some register of the request does not exist or is not accessible this way */
    MODBUS_ILLEGAL_VALUE = 3,   /**< a malformed request, or a value that the register cannot take */
    MODBUS_DEVICE_FAILURE = 4   /**< legal, but not while the amplifier does what it does now */
} modbus_exception_t;

#endif
