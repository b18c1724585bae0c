/* A powered PIC16F15356 alone: registers are written as the program would; flash is full of NOPs, or of a few words. */
#ifndef GSENSE_POWERED_CHIP_H
#define GSENSE_POWERED_CHIP_H

#include <stdbool.h>
#include <string.h>

#include "cmocka_all.h"
#include "fake_outside.h"
#include "pic.h"
#include "registers.h"

#define CONFIG_32_MHZ 0x3F8Fu
#define CONFIG_WDT_OFF 0x3F9Fu

static pic chip;
static struct outside around;

static inline void power_on(void)
{
    pic_program(&chip);
    pic_reset(&chip, RESET_BY_POWER);
}

static inline int set_up(void **state)
{
    (void)state;
    memset(&around, 0, sizeof around);
    pic_init(&chip, &around);
    memset(chip.words, 0, sizeof chip.words);
    chip.config[0] = CONFIG_32_MHZ;
    chip.config[2] = CONFIG_WDT_OFF;
    power_on();
    return 0;
}

static inline void wait(unsigned cycles) { pic_run(&chip, chip.cycles + cycles); }

static inline bool flag(unsigned bank, uint8_t bits) { return (chip.mem[R_PIR0 + bank] & bits) == bits; }

/* Cycles until the flag comes; it is cleared. */
static inline unsigned until_flag(unsigned bank, uint8_t bits)
{
    const uint64_t from = chip.cycles;
    while (!flag(bank, bits) && chip.cycles < from + 10000u) {
        pic_step(&chip);
    }
    assert_true(flag(bank, bits));
    pic_write(&chip, (uint16_t)(R_PIR0 + bank), (uint8_t)(chip.mem[R_PIR0 + bank] & (uint8_t)~bits));
    return (unsigned)(chip.cycles - from);
}

#endif
