/* SPDX-License-Identifier: MIT */
/*
 * The sectors of image_store.h in the chip's flash: 1 and 2, of 16 KB. The linker script leaves them alone. There is
 * one bank. While it is erased or programmed, the processor waits for its next instruction, and so does the sample
 * interrupt. By the datasheet, at 2.7 V or more and 32 bits at a time, to erase takes 0.25 s, at most 0.5 s, and to
 * program 16 us a word. The timeout of the hardware watchdog is longer.
 */
#include "board.h"
#include "stm32f405.h"
#include "supply.h"

#define FIRST_SECTOR   1U
#define SECTOR_ADDRESS 0x08004000UL
#define SECTOR_BYTES   0x4000UL
#define FLASH_LOOKS    20000000U /* more than a second: each is 8 cycles or more */

static uint32_t *sector_words(unsigned sector) {
    return (uint32_t *)(SECTOR_ADDRESS + sector * SECTOR_BYTES);
}

static bool finished(void) {
    for (unsigned look = 0; look < FLASH_LOOKS; look++) {
        const uint32_t status = FLASH->SR;
        if ((status & FLASH_SR_BSY) == 0) {
            FLASH->SR = status & FLASH_SR_ERRORS; /* ones clear them */
            return (status & FLASH_SR_ERRORS) == 0;
        }
    }
    return false;
}

static void unlock(void) {
    if ((FLASH->CR & FLASH_CR_LOCK) != 0) {
        FLASH->KEYR = FLASH_KEY1;
        FLASH->KEYR = FLASH_KEY2;
    }
    (void)finished();
}

const uint32_t *board_store_sector(unsigned sector) {
    return sector_words(sector);
}

/* Not with a supply that sags: 32 bits at a time need 2.7 V. The older copy stays as it is. */
bool board_store_erase(unsigned sector) {
    if (supply_low()) {
        return false;
    }
    unlock();
    watchdog_feed();
    FLASH->CR = FLASH_CR_PSIZE_32 | FLASH_CR_SER | FLASH_CR_SNB(FIRST_SECTOR + sector);
    FLASH->CR |= FLASH_CR_STRT;
    const bool done = finished();
    FLASH->CR = FLASH_CR_LOCK;
    /* The data cache may hold what was there before: RM0090, 3.5.5. */
    const uint32_t access = FLASH->ACR;
    FLASH->ACR = access & ~FLASH_ACR_DCEN;
    FLASH->ACR = (access & ~FLASH_ACR_DCEN) | FLASH_ACR_DCRST;
    FLASH->ACR = access;
    watchdog_feed();
    return done;
}

bool board_store_program(unsigned sector, size_t word, uint32_t value) {
    unlock();
    FLASH->CR = FLASH_CR_PSIZE_32 | FLASH_CR_PG;
    *(volatile uint32_t *)(sector_words(sector) + word) = value;
    wait_for_stores();
    const bool done = finished();
    FLASH->CR = FLASH_CR_LOCK;
    return done;
}
