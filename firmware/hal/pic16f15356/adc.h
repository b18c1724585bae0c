/* The ADC's conversions, one after the other by interrupt. */
#ifndef GSENSE_ADC_H
#define GSENSE_ADC_H

#include <stdint.h>

extern volatile uint8_t adc_left; /* LISY's conversions and the battery's: 0 when all are done */
extern volatile uint16_t adc_lisy_sum;
extern volatile uint16_t adc_battery;

/* For the interrupt's function: books a conversion that has ended and starts the next one. In conversions.asm: it runs 17
 * times a slot. */
void adc_serve(void);

#endif
