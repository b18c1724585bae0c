#include "alive.h"

#include "config.h"

void alive_init(alive *a, uint16_t wanted, uint32_t now)
{
    a->wanted = wanted;
    a->ran = 0;
    a->window_us = now;
    a->good = true;
}

void alive_ran(alive *a, uint8_t job) { a->ran = (uint16_t)(a->ran | (1u << job)); }

bool alive_check(alive *a, uint32_t now)
{
    if ((uint32_t)(now - a->window_us) >= WATCHDOG_WINDOW_US) {
        a->good = (a->ran & a->wanted) == a->wanted;
        a->ran = 0;
        a->window_us = now;
    }
    return a->good;
}
