/* The ADC's conversions, one after the other by interrupt. */
#ifndef GSENSE_ADC_H
#define GSENSE_ADC_H

#include "chip.h"

extern volatile uint8_t adc_left;      /* LISY's conversions and the battery's: 0 when all are done */
extern volatile uint16_t adc_lisy_sum;
extern volatile uint16_t adc_battery;

#define ADC_CHANNEL_LISY 0x01u    /* RA0, ADON */
#define ADC_CHANNEL_BATTERY 0x05u /* RA1, ADON */

/* For the interrupt's function. The next conversion starts 5 us after the last one ended, so that the capacitor has charged. */
#define ADC_SERVE()                                                                                                    \
    do {                                                                                                               \
        if ((PIR1 & PIR1_ADIF) != 0u) {                                                                                \
            PIR1 &= (uint8_t)~PIR1_ADIF;                                                                               \
            --adc_left;                                                                                                \
            if (adc_left == 0u) {                                                                                      \
                adc_battery = (uint16_t)(((uint16_t)ADRESH << 8) | ADRESL);                                            \
            } else {                                                                                                   \
                adc_lisy_sum = (uint16_t)(adc_lisy_sum + (uint16_t)(((uint16_t)ADRESH << 8) | ADRESL));                \
                if (adc_left == 1u) {                                                                                  \
                    ADCON0 = ADC_CHANNEL_BATTERY;                                                                      \
                    adc_wait = ADC_ACQUIRE_LOOPS;                                                                      \
                    while (adc_wait != 0u) {                                                                           \
                        --adc_wait;                                                                                    \
                    }                                                                                                  \
                }                                                                                                      \
                ADCON0 |= ADCON0_GO;                                                                                   \
            }                                                                                                          \
        }                                                                                                              \
    } while (0)

#define ADC_ACQUIRE_LOOPS 8u /* 5 us */
extern volatile uint8_t adc_wait;

#endif
