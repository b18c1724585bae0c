/* What the parts of the emulated chip want of one another. */
#ifndef GSENSE_EMULATOR_PARTS_H
#define GSENSE_EMULATOR_PARTS_H

#include "pic.h"
#include "registers.h"

#define NS_4_MHZ 4000u     /* instruction cycle at 1 MHz */
#define WDT_SOFTWARE 0x1Fu /* in CONFIG3: the program chooses the period */

void pic_push(pic *p, uint16_t target); /* instructions_control.c */
void pic_map_memory(pic *p);            /* memory_map.c */

/* system.c, watchdog.c: events, interrupts, clock, watchdog */
void pic_at(pic *p, pic_event event, uint64_t cycles);
void pic_service(pic *p);
void pic_flag(pic *p, unsigned bank, uint8_t bits); /* sets bits of PIR0 + bank */
void pic_unflag(pic *p, unsigned bank, uint8_t bits);
void pic_look_at_interrupts(pic *p);
void pic_clear_wdt(pic *p);
void pic_sleep(pic *p);
void wdt_rearm(pic *p);
void system_write(pic *p, uint16_t address, uint8_t value);
uint8_t system_read(pic *p, uint16_t address);

/* Of each peripheral: registers with an effect, and its event. */
void timers_reset(pic *p);
uint8_t timers_read(pic *p, uint16_t address);
void timers_write(pic *p, uint16_t address, uint8_t value);
void timers_event(pic *p, pic_event event);

uint8_t ports_read(pic *p, uint16_t address);
void ports_write(pic *p, uint16_t address, uint8_t value);
void ports_changed(pic *p);
/* The level that the chip itself puts on a pin: 0, 1, or -1 where it drives nothing. */
int ports_driven(const pic *p, unsigned pin);
bool ports_routes_out(const pic *p, unsigned pin, uint8_t function);
bool ports_is_digital_input(const pic *p, unsigned pin);

void ssp_reset(pic *p);
uint8_t ssp_read(pic *p, uint16_t address);
void ssp_write(pic *p, uint16_t address, uint8_t value);
void ssp_event(pic *p, unsigned unit);
void i2c_begin(pic *p, ssp_activity what);
void i2c_end(pic *p);
bool i2c_mode(const pic *p);
void spi_begin(pic *p, unsigned unit, uint8_t value);
void spi_end(pic *p, unsigned unit);

void adc_write(pic *p, uint16_t address, uint8_t value);
void adc_event(pic *p);

uint8_t uart_read(pic *p, uint16_t address);
void uart_write(pic *p, uint16_t address, uint8_t value);
void uart_event(pic *p, pic_event event);
void uart_reset(pic *p);

#endif
