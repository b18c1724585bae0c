#include "lisy300.h"

#include "hal.h"

uint16_t lisy300_sum(void) { return hal_adc_sum(HAL_ADC_LISY); }
