/* InvenSense MPU-6050: set-up with read-back, one burst per sample. Registers: RM-MPU-6000A and facts of i2cdevlib. */
#ifndef GSENSE_MPU6050_H
#define GSENSE_MPU6050_H

#include <stdbool.h>
#include <stdint.h>

#include "frame.h"
#include "i2c.h"

#define MPU_REG_SMPLRT_DIV 0x19u
#define MPU_REG_CONFIG 0x1Au
#define MPU_REG_GYRO_CONFIG 0x1Bu
#define MPU_REG_ACCEL_CONFIG 0x1Cu
#define MPU_REG_ACCEL_XOUT_H 0x3Bu
#define MPU_REG_PWR_MGMT_1 0x6Bu
#define MPU_REG_WHO_AM_I 0x75u

#define MPU_WHO_AM_I 0x68u
#define MPU_PWR_RESET 0x80u
#define MPU_PWR_CLOCK_GYRO 0x01u /* PLL on the x gyro, awake */

typedef struct {
    uint8_t dlpf_cfg;
    uint8_t fs_sel;
    uint8_t afs_sel;
    uint8_t smplrt_div;
} mpu6050_config;

typedef enum { MPU_POWER_UP, MPU_RESETTING, MPU_WAKING, MPU_SETTLING, MPU_READY } mpu6050_state;

typedef struct {
    i2c_bus *bus;
    mpu6050_config config; /* wanted; equal to the chip's in MPU_READY */
    mpu6050_state state;
    uint8_t failures; /* consecutive failed bursts */
} mpu6050;

void mpu6050_init(mpu6050 *chip, i2c_bus *bus, const mpu6050_config *config);

/* One step of the set-up (two transfers at most). Returns the us until the next one, 0 once MPU_READY. */
uint32_t mpu6050_setup_step(mpu6050 *chip);

/* Burst 0x3B..0x48 into `registers`. False, and zeros, when the chip is not ready or the transfer failed; after
 * READ_FAILURES_BEFORE_SETUP of them in a row the state falls back to MPU_POWER_UP. */
bool mpu6050_read(mpu6050 *chip, uint8_t registers[MPU_BURST]);

/* Reads the configuration back; false when it is not what was set (brown-out of the chip): then set-up starts over. */
bool mpu6050_verify(mpu6050 *chip);

#endif
