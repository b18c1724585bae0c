/* hal.h over the emulated chips of hal/host, with a clock that only the calls move and faults on demand. */
#ifndef GSENSE_FAKE_HAL_H
#define GSENSE_FAKE_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "chips.h"
#include "frame.h"
#include "hal.h"

#define FAKE_FRAMES 4096u

typedef struct {
    uint64_t time_us; /* since power-on */
    uint32_t start_us; /* what micros() shows at power-on */
    chips registers;
    hal_status fail_mpu; /* HAL_OK: works */
    hal_status fail_bno;
    int fail_at; /* the n-th transfer from now fails, 0: none */
    unsigned recoveries;
    unsigned transfers;
    uint16_t adc[2];
    hal_radio_result radio;
    uint8_t frames[FAKE_FRAMES][FRAME_SIZE];
    unsigned sent;
    bool radio_busy;
    unsigned radio_overruns; /* `send` without `finish` */
    unsigned kicks;
} fake_hal;

extern fake_hal fake;

/* All well, chips powered on, LISY at rest, battery 3.9 V. */
void fake_reset(void);

#endif
