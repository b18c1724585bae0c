/* What stands around the emulated chip; plain functions chosen at link time. Times in ns since power-on. */
#ifndef GSENSE_EMULATOR_OUTSIDE_H
#define GSENSE_EMULATOR_OUTSIDE_H

#include <stdbool.h>
#include <stdint.h>

struct outside;

/* I2C bus, byte by byte. `outside_i2c_send` returns whether somebody acknowledged. */
void outside_i2c_start(struct outside *o, uint64_t ns);
bool outside_i2c_send(struct outside *o, uint8_t byte, uint64_t ns);
uint8_t outside_i2c_receive(struct outside *o, uint64_t ns);
void outside_i2c_acknowledge(struct outside *o, bool ack);
void outside_i2c_stop(struct outside *o, uint64_t ns);
/* Until when SCL is held low by a slave (0: not). */
uint64_t outside_scl_held(struct outside *o, uint64_t ns);
bool outside_sda_held(struct outside *o, uint64_t ns);

/* One byte each way on SPI. */
uint8_t outside_spi(struct outside *o, uint8_t byte, uint64_t ns);
/* The level of an input pin (port * 8 + bit), where `driven` is what the chip itself drives, -1 for nothing. */
bool outside_pin(struct outside *o, unsigned pin, int driven, uint64_t ns);
/* Levels that the chip drives may have changed: `driven(context, pin)` tells. */
void outside_pins_changed(struct outside *o, int (*driven)(const void *context, unsigned pin), const void *context,
                          uint64_t ns);
/* 10-bit conversion of an analog channel. */
uint16_t outside_adc(struct outside *o, unsigned channel, uint64_t ns);
void outside_uart(struct outside *o, uint8_t byte, uint64_t ns);
/* The chip was reset; `power`: everything lost its supply. */
void outside_reset(struct outside *o, bool power, uint64_t ns);
/* Called at every time it asked for; returns the next one. */
uint64_t outside_tick(struct outside *o, uint64_t ns);

#endif
