#include "receiver.h"

#include <string.h>

#include "counters.h"
#include "hal.h"

#define VERIFY_US 1000000u

void receiver_init(receiver *r, const nrf24_config *config)
{
    memset(r, 0, sizeof *r);
    nrf24_init(&r->radio, config, NRF24_RECEIVER);
    r->due_us = hal_micros();
}

static void mind_radio(receiver *r)
{
    const uint32_t now = hal_micros();
    if (!time_reached(now, r->due_us)) {
        return;
    }
    if (r->radio.state == NRF24_READY && nrf24_verify(&r->radio)) {
        r->due_us = now + VERIFY_US;
        return;
    }
    const uint32_t wait = nrf24_setup_step(&r->radio);
    r->due_us = now + VERIFY_US;
    if (wait != 0u) {
        r->due_us = now + wait;
    }
}

/* A full ring loses the newest: the oldest may be half sent already, and its successors are in order. */
static void store(receiver *r, const uint8_t payload[NRF_PAYLOAD])
{
    if (r->waiting == RECEIVER_RING) {
        r->overflow = saturate_u16((uint32_t)r->overflow + 1u);
        return;
    }
    memcpy(r->ring[(uint8_t)((r->first + r->waiting) % RECEIVER_RING)].bytes, payload, NRF_PAYLOAD);
    ++r->waiting;
    r->deepest = r->waiting > r->deepest ? r->waiting : r->deepest;
}

static void take_payloads(receiver *r)
{
    uint8_t payload[NRF_PAYLOAD];
    for (uint8_t i = 0; i < NRF_FIFO_DEPTH; ++i) {
        const nrf24_reception got = nrf24_receive(&r->radio, payload);
        if (got == NRF24_NOTHING) {
            return;
        }
        if (got == NRF24_PAYLOAD) {
            store(r, payload);
        }
    }
}

/* The payload stays in the ring's count until its packet is out whole. */
static void feed_line(receiver *r)
{
    while (r->waiting > 0u) {
        if (r->packet_size == 0u) {
            r->packet_size = (uint8_t)cobs_encode(r->ring[r->first].bytes, NRF_PAYLOAD, r->packet);
            r->packet_sent = 0;
        }
        const uint8_t left = (uint8_t)(r->packet_size - r->packet_sent);
        const uint8_t taken = hal_serial_write(&r->packet[r->packet_sent], left);
        r->packet_sent = (uint8_t)(r->packet_sent + taken);
        if (taken < left) {
            return;
        }
        r->packet_size = 0;
        r->first = (uint8_t)((r->first + 1u) % RECEIVER_RING);
        --r->waiting;
    }
}

void receiver_step(receiver *r)
{
    mind_radio(r);
    take_payloads(r);
    feed_line(r);
    hal_watchdog_kick();
}
