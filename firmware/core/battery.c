#include "battery.h"

#include "config.h"
#include "hal.h"

/* mV a code is FULL_SCALE / 1024; whole mV and 128ths apart, it takes 16 bits alone. */
#define FULL_SCALE_MV (ADC_REFERENCE_MV * BATTERY_DIVIDER)
#define WHOLE_MV (FULL_SCALE_MV / 1024u)
#define REST_128THS (FULL_SCALE_MV % 1024u / 8u)
#if FULL_SCALE_MV % 8u != 0u || REST_128THS > 64u || FULL_SCALE_MV > 65535u
#error "battery: 1023 * REST_128THS has to stay below 65536, and the full scale has to be a multiple of 8 mV"
#endif

void battery_read(battery *cell)
{
    const uint16_t code = hal_adc_sum(HAL_ADC_BATTERY);
    cell->millivolt = (uint16_t)(code * WHOLE_MV + (code * REST_128THS + 64u) / 128u);
    if (cell->millivolt < BATTERY_LOW_MV) {
        cell->low = true;
    } else if (cell->millivolt >= BATTERY_GOOD_MV) {
        cell->low = false;
    } else {
        /* in between: as it was */
    }
}
