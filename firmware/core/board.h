/* The board: jobs on the scheduler's slots, frames to the radio. The HAL's main loop is
 *
 *     board_init(&b, &board_profile_default);
 *     for (;;) { wait_until(board_step(&b)); }
 */
#ifndef GSENSE_BOARD_H
#define GSENSE_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "alive.h"
#include "battery.h"
#include "bno055.h"
#include "frame.h"
#include "i2c.h"
#include "mpu6050.h"
#include "nrf24.h"
#include "sample_clock.h"
#include "scheduler.h"

/* In order of importance. */
enum {
    JOB_MPU = 0,    /* MPU burst, LISY300, battery; frame to the radio */
    JOB_BNO_SEND,   /* frame of the last BNO burst, when there is room before the next MPU slot */
    JOB_BNO_READ,   /* BNO burst */
    JOB_BNO_LOOK,   /* has the BNO a new sample? */
    JOB_STATUS,     /* STATUS frame */
    JOB_BNO_HEALTH, /* temperature, calibration state */
    JOB_VERIFY,     /* are the chips still configured as set? */
    JOB_RADIO_VERIFY, /* and is the radio? */
    JOB_MPU_SETUP,
    JOB_BNO_SETUP,
    JOB_RADIO_SETUP
};

typedef struct {
    scheduler_rates rates;
    mpu6050_config mpu;
    bno055_config bno;
} board_profile;

extern const nrf24_config radio_config; /* board and receiver */
extern const board_profile board_profile_default; /* MPU 200 Hz, BNO 100 Hz */
extern const board_profile board_profile_fast;    /* MPU 500 Hz, BNO 100 Hz */

typedef struct {
    const board_profile *profile;
    i2c_bus bus;
    mpu6050 mpu;
    bno055 bno;
    sample_clock bno_clock;
    battery cell;
    nrf24 radio;
    alive jobs;
    scheduler slots;
    uint16_t sequence;
    uint32_t uptime_s;
    uint32_t uptime_mark_us;
    bool announced; /* a STATUS frame with a set-up MPU went out: scales are known to the other side */
    bool bno_pending;
    bool bno_failed;
    uint32_t bno_time_us;
    frame_header header; /* parts of the frame in the making; they are here for their fixed addresses */
    frame_mpu mpu_body;
    frame_bno bno_body;
    uint8_t mpu_registers[MPU_BURST];
    uint8_t frame[FRAME_SIZE];
    uint8_t bno_registers[BNO_NDOF_BURST]; /* read, not yet sent */
} board;

/* `bno_mode`: BNO_MODE_AMG or BNO_MODE_NDOF in place of the profile's, 0 keeps it. */
void board_init(board *b, const board_profile *profile, uint8_t bno_mode);

/* Runs one job if one is due. Returns the board time at which to call again (now, if more is due). */
uint32_t board_step(board *b);

#endif
