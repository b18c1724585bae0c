/* Everything a user of the board may want to change, in one place. Times in us unless the name says otherwise. */
#ifndef GSENSE_CONFIG_H
#define GSENSE_CONFIG_H

#define FIRMWARE_MAJOR 0u
#define FIRMWARE_MINOR 3u

/* I2C: one transfer is 18 bytes at most (0.5 ms at 400 kHz); the BNO055 stretches the clock for up to about 1 ms more. */
#define I2C_DEADLINE_US 2500u
#define READ_FAILURES_BEFORE_SETUP 10u /* consecutive failed reads after which a chip is set up anew */
#define SETUP_RETRY_US 100000u

/* MPU-6050: 42 Hz gyro filter, +-500 deg/s, +-4 g, 1 kHz / (1 + 4) = 200 Hz (fast profile: 188 Hz filter, 500 Hz). */
#define MPU_ADDRESS 0x68u
#define MPU_DLPF_CFG 3u
#define MPU_DLPF_CFG_FAST 1u
#define MPU_FS_SEL 1u
#define MPU_AFS_SEL 1u
#define MPU_SMPLRT_DIV 4u
#define MPU_SMPLRT_DIV_FAST 1u

/* BNO055 in AMG: the chip's own defaults, written all the same so that a read-back can prove them. */
#define BNO_ADDRESS 0x28u
#define BNO_ACC_CONFIG 0x0Du   /* +-4 g, 62.5 Hz bandwidth */
#define BNO_MAG_CONFIG 0x0Bu   /* 10 Hz, regular preset */
#define BNO_GYR_CONFIG_0 0x38u /* +-2000 deg/s, 32 Hz bandwidth, a new sample every 10 ms */
#define BNO_GYR_CONFIG_1 0x00u /* normal power */
#define BNO_UNIT_SEL 0x00u     /* m/s^2 (100 LSB), deg/s (16 LSB), degrees, Celsius */
#define BNO_GYRO_PERIOD_US 10000u /* nominal, follows from BNO_GYR_CONFIG_0 */

/* 18650 cell behind a 1:1 divider on the 10-bit ADC, reference 3.3 V. */
#define ADC_REFERENCE_MV 3300u
#define BATTERY_DIVIDER 2u
#define BATTERY_LOW_MV 3300u
#define BATTERY_GOOD_MV 3400u /* hysteresis: low ends here */

/* nRF24L01+: 2 Mbit/s, 16-bit CRC, 5-byte address. Board and receiver share it. */
#define RADIO_CHANNEL 80u /* 2480 MHz: the upper end of the band that is free in Europe */
#define RADIO_ADDRESS {0x67u, 0x73u, 0x6Eu, 0x73u, 0x31u}
#define RADIO_RETRIES 3u  /* ARD 250 us: at most 1.8 ms a frame */
#define RADIO_AUTO_ACK true /* false for clones without it */
#define RADIO_TIMEOUT_US 2500u /* a frame not through by then: the chip is stuck */

/* Receiver: 600 frames/s for 50 ms are 30 payloads; 3 more wait in the chip. */
#define RECEIVER_RING 40u

/* The watchdog is kicked while every periodic job ran in the last window; longer than the slowest one's period. */
#define WATCHDOG_WINDOW_US 1500000u

#define STARTED_FLAG_US 1000000u /* flag bit 1 is set for this long after the start */

#endif
