/* hal.h over the emulated chips of hal/host, with a clock that only the calls move and faults on demand. */
#ifndef GSENSE_FAKE_HAL_H
#define GSENSE_FAKE_HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "air.h"
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
    air air;
    bool in_receiver;     /* whose pins the radio's functions mean */
    bool receiver_reads;  /* the receiver's FIFO empties by itself */
    bool radio_dead;      /* reads zeros */
    bool ignores_flush;
    bool irq_low;         /* for no reason */
    bool frozen;          /* the timer stands still */
    unsigned sda_clocks;  /* until SDA is let go */
    bool sda_short;       /* never */
    bool scl;
    unsigned scl_clocks;
    uint8_t serial[4096]; /* what the receiver wrote */
    unsigned serial_size;
    unsigned serial_room; /* bytes that the line takes before it stalls */
    uint8_t frames[FAKE_FRAMES][FRAME_SIZE];
    unsigned sent;
    unsigned radio_overruns; /* a third payload in the chip */
    unsigned kicks;
} fake_hal;

extern fake_hal fake;

/* All well, chips powered on, a receiver listening, LISY at rest, battery 3.9 V. */
void fake_reset(void);

#endif
