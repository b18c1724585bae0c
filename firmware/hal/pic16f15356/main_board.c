/* The board's chip: main and interrupt. */
#include "adc.h"
#include "chip.h"
#include "clock.h"
#include "configuration.h"
#include "hal.h"
#include "peripherals.h"
#include "program.h"

void interrupt_served(void) CHIP_INTERRUPT
{
    if ((PIR1 & PIR1_ADIF) != 0u) { /* a call is a level of the stack, which has 16 */
        adc_serve();
    }
    CLOCK_SERVE();
}

void main(void)
{
    chip_init();
    hal_i2c_restart();
    spi_init();
    adc_init();
    program_run();
}
