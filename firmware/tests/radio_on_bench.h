/* A radio that has been set up, and a payload. */
#ifndef GSENSE_RADIO_ON_BENCH_H
#define GSENSE_RADIO_ON_BENCH_H

#include "board.h"
#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"
#include "nrf24.h"

static nrf24 radio;
static uint8_t payload[NRF_PAYLOAD];

static inline void set_up(nrf24 *r, const nrf24_config *config, nrf24_role role)
{
    nrf24_init(r, config, role);
    for (int i = 0; i < 10 && r->state != NRF24_READY; ++i) {
        fake.time_us += nrf24_setup_step(r);
    }
}

static inline int setup(void **state)
{
    (void)state;
    fake_reset();
    for (unsigned i = 0; i < NRF_PAYLOAD; ++i) {
        payload[i] = (uint8_t)(i + 1);
    }
    set_up(&radio, &radio_config, NRF24_TRANSMITTER);
    return 0;
}

static inline uint64_t send_and_wait(void)
{
    nrf24_send(&radio, payload);
    const uint64_t begun = fake.time_us;
    nrf24_finish(&radio);
    return fake.time_us - begun;
}

#endif
