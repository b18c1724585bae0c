/* What the core needs from a chip or a host. Plain functions chosen at link time: calls through pointers are slow on the
 * target's 8-bit core. Every call returns within a bounded time; none calls back into the core. */
#ifndef GSENSE_HAL_H
#define GSENSE_HAL_H

#include <stdbool.h>
#include <stdint.h>

#define RADIO_PAYLOAD 32u

typedef enum {
    HAL_OK = 0,
    HAL_NACK,    /* nobody answered, or the chip refused a byte */
    HAL_TIMEOUT, /* not finished by its deadline (clock stretched too long) */
    HAL_STUCK    /* SDA or SCL held low: needs hal_i2c_recover */
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

typedef struct {
    bool given_up;           /* all retries of the frame failed; the radio is ready for the next one */
    uint8_t retransmissions; /* of that frame, 0 to 15 */
} hal_radio_result;

/* Free-running timer, wraps at 2^32 us. */
uint32_t hal_micros(void);

/* One write of the register number, repeated start, one read of `length` bytes, all within `deadline_us`. */
hal_status hal_i2c_read(uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, uint16_t deadline_us);
hal_status hal_i2c_write(uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint16_t deadline_us);
/* Nine clocks, STOP, peripheral set up anew. */
void hal_i2c_recover(void);

/* One 10-bit conversion, 0 to 1023. */
uint16_t hal_adc_read(hal_adc_channel channel);

/* The radio works beside the CPU: `send` hands a payload over, `finish` waits (bounded by the radio's own retries, 1.7 ms)
 * until it is through and tells how it went. `finish` comes before the next `send`. */
void hal_radio_send(const uint8_t payload[RADIO_PAYLOAD]);
hal_radio_result hal_radio_finish(void);

void hal_watchdog_kick(void);
reset_cause hal_reset_cause(void);

#endif
