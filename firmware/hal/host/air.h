/* Two nRF24L01+ and the air between them: addresses, auto-ack, retries and their times at 2 Mbit/s, losses.
 *
 * A transmission is decided as a whole when it begins: the receiver has the payload at once, the transmitter's flags follow
 * when the air time and the retries are over (461 us without a retry, 414 us each).
 */
#ifndef GSENSE_AIR_H
#define GSENSE_AIR_H

#include <stdbool.h>
#include <stdint.h>

#include "chance.h"
#include "nrf24_chip.h"

typedef struct {
    nrf_chip sender;
    nrf_chip receiver;
    double lose;      /* probability that all attempts of a frame fail */
    double repeat;    /* that the receiver delivers it twice, as clones do that miss the packet's number */
    double attempt;   /* that one packet or one acknowledgement is not heard */
    bool stuck;       /* the sender's chip takes payloads, but never gets through */
    chance lose_stream;
    chance repeat_stream;
    chance attempt_stream;
    uint64_t frames;  /* begun */
    uint64_t undelivered;
    uint64_t attempts;
    uint64_t heard_ns; /* when the last delivered one was received */
    bool heard_twice;
} air;

void air_init(air *a, uint32_t seed);
/* Begins what can begin, ends what is over by `now_ns`. To be called before every look at the sender's chip and after every
 * transaction with it. True when the receiver got a payload. */
bool air_advance(air *a, uint64_t now_ns);

#endif
