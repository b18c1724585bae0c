#include "lisy300.h"

#include "hal.h"

uint16_t lisy300_sum(void)
{
    uint16_t sum = 0;
    for (uint8_t i = 0; i < LISY_CONVERSIONS; ++i) {
        sum = (uint16_t)(sum + hal_adc_read(HAL_ADC_LISY));
    }
    return sum;
}
