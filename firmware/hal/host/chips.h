/* The register files of MPU-6050 and BNO055 as the I2C bus sees them: pages, modes, sleep and reset. */
#ifndef GSENSE_CHIPS_H
#define GSENSE_CHIPS_H

#include <stdbool.h>
#include <stdint.h>

#include "image.h"

#define CHIP_REGISTERS 128u

typedef struct {
    uint8_t mpu[CHIP_REGISTERS];
    uint8_t bno[2][CHIP_REGISTERS]; /* pages */
    uint64_t bno_answers_from_ns;   /* silent while it boots */
} chips;

void chips_power_on(chips *c, uint64_t now_ns);

/* One read of `length` registers; data registers come from `image`. False: nobody answers (NACK). */
bool chips_read(const chips *c, uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, const sensor_image *image);
/* One write at `now_ns`. False: nobody answers. */
bool chips_write(chips *c, uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint64_t now_ns);

bool chips_answer(const chips *c, uint8_t address, uint64_t now_ns);

#endif
