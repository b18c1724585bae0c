/* The receiver's serial line: a small ring that the interrupt empties. */
#ifndef GSENSE_SERIAL_H
#define GSENSE_SERIAL_H

#include <stdint.h>

#include "chip.h"

#define SERIAL_RING 64u /* a power of two */

extern uint8_t serial_ring[SERIAL_RING];
extern volatile uint8_t serial_first;
extern volatile uint8_t serial_waiting;

/* For the interrupt's function. */
#define SERIAL_SERVE()                                                                                                 \
    do {                                                                                                               \
        if ((PIE3 & PIR3_TX1IF) != 0u && (PIR3 & PIR3_TX1IF) != 0u) {                                                  \
            TX1REG = serial_ring[serial_first];                                                                        \
            serial_first = (uint8_t)((serial_first + 1u) & (SERIAL_RING - 1u));                                        \
            --serial_waiting;                                                                                          \
            if (serial_waiting == 0u) {                                                                                \
                PIE3 &= (uint8_t)~PIR3_TX1IF;                                                                          \
            }                                                                                                          \
        }                                                                                                              \
    } while (0)

#endif
