/* What the two programs switch on. */
#ifndef GSENSE_PERIPHERALS_H
#define GSENSE_PERIPHERALS_H

void spi_init(void);
void adc_init(void);
void serial_init(void);

#endif
