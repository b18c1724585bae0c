/* LISY300AL, an analog yaw-rate sensor: 1.65 V at rest, 3.3 mV per deg/s, read by the 10-bit ADC. */
#ifndef GSENSE_LISY300_H
#define GSENSE_LISY300_H

#include <stdint.h>

/* Sum of 16 conversions, 0 to 16368: V = sum * 3.3 / 16384. Its noise is above one ADC step, so the sum gains 2 bits.
 * Of the conversions that hal_adc_start began. */
uint16_t lisy300_sum(void);

#endif
