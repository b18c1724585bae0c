/* When the watchdog may be kicked: only while every job that has to run does run. A loop that hangs never gets here; a job
 * that starves while the loop turns stops the kicks at the end of its window. */
#ifndef GSENSE_ALIVE_H
#define GSENSE_ALIVE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint16_t wanted; /* one bit a job */
    uint16_t ran;    /* in this window */
    uint32_t window_us; /* its start */
    bool good;       /* all ran in the last one (or this is the first) */
} alive;

void alive_init(alive *a, uint16_t wanted, uint32_t now);
void alive_ran(alive *a, uint8_t job);
/* True when the watchdog may be kicked at `now`. */
bool alive_check(alive *a, uint32_t now);

#endif
