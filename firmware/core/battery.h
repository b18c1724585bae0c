/* The cell's voltage, and "low" with hysteresis. */
#ifndef GSENSE_BATTERY_H
#define GSENSE_BATTERY_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint16_t millivolt;
    bool low;
} battery;

void battery_read(battery *cell);

#endif
