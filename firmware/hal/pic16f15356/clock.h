/* Timer 1 counts microseconds; its overflows, counted by the interrupt, are the upper half of hal_micros(). */
#ifndef GSENSE_CLOCK_H
#define GSENSE_CLOCK_H

#include "chip.h"

extern volatile uint8_t clock_overflow_low;
extern volatile uint8_t clock_overflow_high;

/* For the interrupt's function. */
#define CLOCK_SERVE()                                                                                                  \
    do {                                                                                                               \
        if ((PIR4 & PIR4_TMR1IF) != 0u) {                                                                              \
            PIR4 &= (uint8_t)~PIR4_TMR1IF;                                                                             \
            ++clock_overflow_low;                                                                                      \
            if (clock_overflow_low == 0u) {                                                                            \
                ++clock_overflow_high;                                                                                 \
            }                                                                                                          \
        }                                                                                                              \
    } while (0)

#endif
