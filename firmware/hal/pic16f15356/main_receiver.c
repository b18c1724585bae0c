/* The receiver's chip: main and interrupt. */
#include "chip.h"
#include "clock.h"
#include "configuration.h"
#include "peripherals.h"
#include "program.h"
#include "serial.h"

void interrupt_served(void) CHIP_INTERRUPT
{
    SERIAL_SERVE();
    CLOCK_SERVE();
}

void main(void)
{
    chip_init();
    spi_init();
    serial_init();
    program_run();
}
