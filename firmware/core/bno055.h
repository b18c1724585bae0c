/* Bosch BNO055 in AMG (raw) or NDOF (the chip's own fusion): set-up as a state machine that never waits, one burst per
 * sample. Registers: BST-BNO055-DS000-14. Page 1 holds the sensors' configuration and is written in CONFIG mode only. */
#ifndef GSENSE_BNO055_H
#define GSENSE_BNO055_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"
#include "i2c.h"

/* page 0 */
#define BNO_REG_CHIP_ID 0x00u
#define BNO_REG_PAGE_ID 0x07u
#define BNO_REG_ACC_DATA 0x08u   /* acc, mag, gyr: 18 bytes */
#define BNO_REG_GYR_DATA 0x14u
#define BNO_REG_EULER_DATA 0x1Au /* Euler, quaternion, linear acceleration: 20 bytes */
#define BNO_REG_TEMP 0x34u       /* followed by CALIB_STAT */
#define BNO_REG_CALIB_STAT 0x35u
#define BNO_REG_UNIT_SEL 0x3Bu
#define BNO_REG_OPR_MODE 0x3Du
#define BNO_REG_PWR_MODE 0x3Eu
#define BNO_REG_SYS_TRIGGER 0x3Fu
/* page 1: ACC_CONFIG, MAG_CONFIG, GYR_CONFIG_0, GYR_CONFIG_1 follow one another */
#define BNO_REG1_ACC_CONFIG 0x08u
#define BNO_CONFIG_BYTES 4u

#define BNO_CHIP_ID 0xA0u
#define BNO_MODE_CONFIG 0x00u
#define BNO_MODE_AMG 0x07u
#define BNO_MODE_NDOF 0x0Cu
#define BNO_TRIGGER_RESET 0x20u

#define BNO_GYR_BYTES 6u
#define BNO_GYR_IN_BURST (BNO_REG_GYR_DATA - BNO_REG_ACC_DATA)

typedef struct {
    uint8_t mode; /* BNO_MODE_AMG or BNO_MODE_NDOF */
    uint8_t acc_config;
    uint8_t mag_config;
    uint8_t gyr_config_0;
    uint8_t gyr_config_1;
    uint8_t unit_sel;
} bno055_config;

typedef enum {
    BNO_POWER_UP,    /* answers 650 ms after power or reset */
    BNO_IDENTIFY,    /* chip id, then page 0 and CONFIG mode */
    BNO_SET_UNITS,   /* power mode, UNIT_SEL with read-back */
    BNO_SET_SENSORS, /* page 1, the four configuration bytes with read-back, page 0 */
    BNO_SET_MODE,
    BNO_CHECK_MODE,
    BNO_READY
} bno055_state;

typedef struct {
    i2c_bus *bus;
    bno055_config config; /* wanted; equal to the chip's in BNO_READY */
    bno055_state state;
    uint8_t failures;       /* consecutive failed bursts */
    uint8_t setup_failures; /* consecutive failed set-ups; every fourth one resets the chip */
    uint8_t temperature;
    uint8_t calib_stat;
} bno055;

void bno055_init(bno055 *chip, i2c_bus *bus, const bno055_config *config);

/* One step of the set-up (a few short transfers). Returns the us until the next one, 0 once BNO_READY. */
uint32_t bno055_setup_step(bno055 *chip);

/* The mode the chip is known to be in: CONFIG until BNO_READY. */
uint8_t bno055_mode(const bno055 *chip);

/* Burst of the mode (18 or 20 bytes) into `registers`. False, and zeros, as with mpu6050_read. */
bool bno055_read(bno055 *chip, uint8_t registers[BNO_NDOF_BURST]);
/* The gyro's 6 bytes alone, to see whether a new sample has come. */
bool bno055_read_gyro(bno055 *chip, uint8_t gyro[BNO_GYR_BYTES]);
/* Temperature and CALIB_STAT into the chip's fields. */
bool bno055_read_health(bno055 *chip);

/* Reads the mode back; a chip that lost it (brown-out) is set up again. */
bool bno055_verify(bno055 *chip);

#endif
