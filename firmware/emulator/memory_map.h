/* Who answers at each address of the data memory: `pic.kind`. */
#ifndef GSENSE_MEMORY_MAP_H
#define GSENSE_MEMORY_MAP_H

enum { PLAIN = 0, CORE, NOWHERE, UNMODELLED, PORT, TIMER, SSP, ADC_UNIT, UART, SYSTEM };

#define BANK 0x80u
#define GPR_FIRST 0x20u
#define COMMON 0x70u

#endif
