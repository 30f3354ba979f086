/* SPDX-License-Identifier: MIT */
/*
 * A conversation with the amplifier. The input is a list of requests, each a length byte and a PDU; the CRC is made
 * here, since no fuzzer guesses it. After each request the loop runs some samples.
 */
#include "amplifier.h"
#include "fake_board.h"
#include "master.h"
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(bool truth) {
    if (!truth) {
        abort();
    }
}

static void ask(const uint8_t *pdu, size_t length) {
    uint8_t frame[MODBUS_FRAME_MAX];
    uint8_t *reply = malloc(MODBUS_FRAME_MAX); /* on the heap, where the sanitizer sees every byte too far */
    size_t reply_length;
    require(reply != NULL);
    const size_t frame_length = master_frame(frame, MASTER_SERVER, pdu, length);
    const modbus_outcome_t outcome = modbus_serve(frame, frame_length, reply, &reply_length);
    if (pdu[0] >= 0x80U) {
        require(outcome == MODBUS_FRAME_FOREIGN && reply_length == 0);
        free(reply);
        return;
    }
    require(outcome == MODBUS_FRAME_ANSWERED || outcome == MODBUS_FRAME_REFUSED);
    require(reply_length >= 5 && reply_length <= MODBUS_FRAME_MAX && modbus_crc(reply, reply_length) == 0);
    free(reply);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fake_board_power_on(0);
    while (size > 1) {
        size_t length = data[0] % (MODBUS_FRAME_MAX - 3U) + 1U;
        length = length < size ? length : size - 1U;
        ask(data + 1, length);
        data += 1U + length;
        size -= 1U + length;
        (void)fake_board_run(3);
        (void)amplifier_serve();
    }
    return 0;
}
