/* What the sensors' registers hold at one instant: an image of the sensor bus, or of the bench. */
#ifndef GSENSE_IMAGE_H
#define GSENSE_IMAGE_H

#include <stdint.h>

#define IMAGE_MPU_BYTES 14u
#define IMAGE_BNO_BYTES 46u
#define IMAGE_BNO_FIRST 0x08u /* register of the first of them */
#define IMAGE_LISY 16u

typedef struct {
    uint64_t time_ns;                  /* CLOCK_MONOTONIC */
    uint8_t mpu[IMAGE_MPU_BYTES];      /* 0x3B..0x48 */
    uint8_t bno[IMAGE_BNO_BYTES];      /* page 0, 0x08..0x35 */
    uint64_t bno_time_ns;              /* of the newest gyro sample */
    uint16_t lisy[IMAGE_LISY];         /* 10-bit conversions */
    uint16_t battery_mv;
} sensor_image;

#endif
