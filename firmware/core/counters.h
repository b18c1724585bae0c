/* Wrapping time and counters that stop at their end. */
#ifndef GSENSE_COUNTERS_H
#define GSENSE_COUNTERS_H

#include <stdbool.h>
#include <stdint.h>

/* True when `now` is at or past `due`, across the 32-bit wrap (both less than 35 minutes apart). */
static inline bool time_reached(uint32_t now, uint32_t due) { return (uint32_t)(now - due) < 0x80000000u; }

static inline void count_u8(uint8_t *counter)
{
    if (*counter < UINT8_MAX) {
        ++*counter;
    }
}

static inline uint16_t saturate_u16(uint32_t value)
{
    if (value > UINT16_MAX) {
        return UINT16_MAX;
    }
    return (uint16_t)value;
}

#endif
