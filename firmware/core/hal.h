/* What the core needs from a chip or a host. Plain functions chosen at link time: calls through pointers are slow on the
 * target's 8-bit core. Every call returns within a bounded time; none calls back into the core. */
#ifndef GSENSE_HAL_H
#define GSENSE_HAL_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    HAL_OK = 0,
    HAL_NACK,    /* nobody answered, or the chip refused a byte */
    HAL_TIMEOUT, /* not finished by its deadline (clock stretched too long) */
    HAL_STUCK    /* SDA or SCL held low: the lines have to be freed first (i2c.c does it) */
} hal_status;

typedef enum { HAL_ADC_LISY = 0, HAL_ADC_BATTERY } hal_adc_channel;

typedef enum { /* byte 18 of the STATUS frame */
    RESET_UNKNOWN = 0,
    RESET_POWER_ON,
    RESET_BROWN_OUT,
    RESET_WATCHDOG,
    RESET_PIN,
    RESET_SOFTWARE
} reset_cause;

/* Free-running timer, wraps at 2^32 us. */
uint32_t hal_micros(void);

/* One write of the register number, repeated start, one read of `length` bytes, all within `deadline_us`. */
hal_status hal_i2c_read(uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, uint16_t deadline_us);
hal_status hal_i2c_write(uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint16_t deadline_us);
/* Both lines as open-drain pins, away from the peripheral (true: released); waits half a clock (5 us at least) and returns
 * whether SDA reads high. */
bool hal_i2c_drive(bool scl, bool sda);
/* The lines back to the peripheral, which is set up anew. */
void hal_i2c_restart(void);

/* 10-bit ADC. `start` begins LISY_CONVERSIONS conversions of the LISY300 and one of the battery, which go on by themselves;
 * `sum` waits for their end (0.5 ms from the start) and gives the sum of the channel's, each 0 to 1023. */
#define LISY_CONVERSIONS 16u
void hal_adc_start(void);
uint16_t hal_adc_sum(hal_adc_channel channel);

/* nRF24L01+: one SPI transaction (mode 0, 2 MHz at most, MSB first): CSN low, command, `length` bytes, CSN high. Returns
 * the STATUS register that the chip shifts out during the command. */
uint8_t hal_radio_write(uint8_t command, const uint8_t *data, uint8_t length);
uint8_t hal_radio_read(uint8_t command, uint8_t *data, uint8_t length);
void hal_radio_ce(bool high);
/* True while the chip's IRQ line is low. */
bool hal_radio_irq(void);

/* Only the receiver has it: takes as many bytes as find room at once, never waits. Returns their number. */
uint8_t hal_serial_write(const uint8_t *data, uint8_t length);

void hal_watchdog_kick(void);
reset_cause hal_reset_cause(void);

#endif
