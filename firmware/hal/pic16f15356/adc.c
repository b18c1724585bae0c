/* The 10-bit ADC: RA0 LISY300, RA1 battery; 1 us a bit (FOSC/32), reference is the supply. */
#include "adc.h"

#include "chip.h"
#include "hal.h"
#include "peripherals.h"

#define RIGHT_FOSC_32_VDD 0xA0u
#define CHANNEL_LISY 0x01u /* RA0, ADON */
#define POLLS 1000u /* about 2 ms */

void adc_init(void)
{
    adc_left = 0u;
    adc_lisy_sum = 0u;
    adc_battery = 0u;
    ADCON1 = RIGHT_FOSC_32_VDD;
    ADCON0 = CHANNEL_LISY;
    PIR1 &= (uint8_t)~PIR1_ADIF;
    PIE1 |= PIR1_ADIF;
}

void hal_adc_start(void)
{
    if (adc_left != 0u) { /* never asked for: let them end */
        return;
    }
    ADCON0 = CHANNEL_LISY; /* since the last sum, mostly: acquired long ago */
    adc_lisy_sum = 0u;
    adc_left = LISY_CONVERSIONS + 1u;
    ADCON0 |= ADCON0_GO;
}

uint16_t hal_adc_sum(hal_adc_channel channel)
{
    for (uint16_t polls = POLLS; adc_left != 0u && polls != 0u; --polls) {
    }
    adc_left = 0u; /* a sweep that did not end is begun anew */
    if (channel == HAL_ADC_LISY) {
        return adc_lisy_sum;
    }
    ADCON0 = CHANNEL_LISY;
    return adc_battery;
}
