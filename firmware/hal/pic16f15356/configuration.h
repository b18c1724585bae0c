/* The chip's configuration words (DS40001866, chapter 5) for both programs: 32 MHz from the internal oscillator, watchdog always
 * on at 0.5 s, brown-out reset at 2.7 V, reset on stack overflow. Included once a program, by its main. */
#ifndef GSENSE_CONFIGURATION_H
#define GSENSE_CONFIGURATION_H

#include <stdint.h>

#ifdef __XC8 /* never built */
#pragma config FEXTOSC = OFF, RSTOSC = HFINT32, CLKOUTEN = OFF, CSWEN = ON, FCMEN = OFF
#pragma config MCLRE = ON, PWRTE = ON, LPBOREN = OFF, BOREN = ON, BORV = HI, STVREN = ON
#pragma config WDTCPS = WDTCPS_9, WDTE = ON, WDTCWS = WDTCWS_7, WDTCCS = LFINTOSC, LVP = ON, CP = OFF
#else
static __code uint16_t __at(0x8007) config1 = 0x1F8C; /* FEXTOSC off, RSTOSC HFINT32, FCMEN off */
static __code uint16_t __at(0x8008) config2 = 0x3DFD; /* PWRTE on, BOREN on, BORV high, STVREN on */
static __code uint16_t __at(0x8009) config3 = 0x07E9; /* WDTE on, 1:16384 of 31 kHz, no window */
static __code uint16_t __at(0x800A) config4 = 0x3FFF; /* low-voltage programming allowed */
static __code uint16_t __at(0x800B) config5 = 0x3FFF;
#endif

#endif
