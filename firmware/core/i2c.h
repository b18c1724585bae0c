/* I2C transfers as the core uses them: one deadline for all, a stuck bus freed, every failure counted. */
#ifndef GSENSE_I2C_H
#define GSENSE_I2C_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint8_t errors;     /* failed transfers; all four stay at 255 */
    uint8_t timeouts;   /* of these: the clock stretched past the deadline */
    uint8_t recoveries; /* nine clocks, STOP, peripheral set up anew */
    uint8_t stuck;      /* of these: SDA stayed low all the same */
} i2c_bus;

bool i2c_read(i2c_bus *bus, uint8_t address, uint8_t reg, uint8_t *data, uint8_t length);
bool i2c_write(i2c_bus *bus, uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length);
bool i2c_write_byte(i2c_bus *bus, uint8_t address, uint8_t reg, uint8_t value);

/* A chip that was cut off while it sent a zero holds SDA low until it is clocked to the end of its byte: up to nine clocks,
 * then START and STOP. True when SDA is free. */
bool i2c_recover(i2c_bus *bus);

#endif
