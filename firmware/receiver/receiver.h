/* The receiver: payloads from the nRF24L01+ as COBS packets to a serial line (hal_serial_write). A ring holds what the line
 * cannot take: 40 payloads, 66 ms at 600 frames a second, and the chip's own FIFO holds 3 more. What is sent twice by the
 * radio goes out twice; the host sees it by the sequence number.
 *
 *     receiver_init(&r, &radio_config);
 *     for (;;) { receiver_step(&r); }
 */
#ifndef GSENSE_RECEIVER_H
#define GSENSE_RECEIVER_H

#include <stdint.h>

#include "cobs.h"
#include "config.h"
#include "nrf24.h"

typedef struct {
    uint8_t bytes[NRF_PAYLOAD];
} receiver_payload;

typedef struct {
    nrf24 radio;
    uint32_t due_us; /* of the next set-up step, or of the next look at the radio's registers */
    receiver_payload ring[RECEIVER_RING];
    uint8_t first;
    uint8_t waiting;
    uint8_t packet[COBS_PACKET_SIZE(NRF_PAYLOAD)];
    uint8_t packet_size; /* 0: none begun */
    uint8_t packet_sent;
    uint8_t deepest;   /* most payloads that ever waited */
    uint16_t overflow; /* payloads lost to a full ring, stays at 65535 */
} receiver;

void receiver_init(receiver *r, const nrf24_config *config);
/* Never waits. Has to be called every 3 frames at least (5 ms at 600 a second). */
void receiver_step(receiver *r);

#endif
