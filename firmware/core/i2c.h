/* I2C transfers as the core uses them: one deadline for all, a stuck bus recovered, every failure counted. */
#ifndef GSENSE_I2C_H
#define GSENSE_I2C_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint8_t errors; /* failed transfers, stays at 255 */
} i2c_bus;

bool i2c_read(i2c_bus *bus, uint8_t address, uint8_t reg, uint8_t *data, uint8_t length);
bool i2c_write(i2c_bus *bus, uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length);
bool i2c_write_byte(i2c_bus *bus, uint8_t address, uint8_t reg, uint8_t value);

#endif
