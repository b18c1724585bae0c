#include "battery.h"

#include "config.h"
#include "hal.h"

#define FULL_SCALE_MV ((uint32_t)ADC_REFERENCE_MV * BATTERY_DIVIDER)

void battery_read(battery *cell)
{
    const uint32_t code = hal_adc_read(HAL_ADC_BATTERY);
    cell->millivolt = (uint16_t)((code * FULL_SCALE_MV + 512u) / 1024u);
    if (cell->millivolt < BATTERY_LOW_MV) {
        cell->low = true;
    } else if (cell->millivolt >= BATTERY_GOOD_MV) {
        cell->low = false;
    } else {
        /* in between: as it was */
    }
}
