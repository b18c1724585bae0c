/* Inner loops in bursts.asm, over the buffer that chip_point_fsr1 was given. */
#ifndef GSENSE_BURSTS_H
#define GSENSE_BURSTS_H

#include <stdint.h>

/* START, address for writing (in its upper seven bits), register, repeated START, address for reading. */
#define I2C_SELECTED 1u
#define I2C_REFUSED 2u /* any other answer: not within `polls`, or the bus was lost */
uint8_t i2c_select(uint8_t address, uint8_t reg, uint16_t polls);

/* Receives `length` bytes and acknowledges all but the last; 0 when all waits together took more than `polls`, else 1. */
uint8_t i2c_burst(uint8_t length, uint16_t polls);

/* At least one byte each. */
void spi_send(uint8_t length);
void spi_take(uint8_t length);

#endif
