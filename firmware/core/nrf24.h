/* nRF24L01+ as transmitter (board) or receiver. Nothing waits but `nrf24_finish` and `nrf24_make_room`, for
 * RADIO_TIMEOUT_US a frame at most. Two frames may be with the chip: one on the air, one behind it.
 *
 *   POWER_UP --100 ms--> CONFIGURE (registers, read back) --5 ms after PWR_UP--> STARTING --> READY
 *
 * A chip that does not read back as written stays in CONFIGURE and is tried again; one that lost its registers later (a
 * brown-out of the radio alone) or hangs twice in a row falls back to it. Every frame that did not get through is counted.
 */
#ifndef GSENSE_NRF24_H
#define GSENSE_NRF24_H

#include <stdbool.h>
#include <stdint.h>

#include "nrf24_registers.h"

typedef struct {
    uint8_t channel; /* 2400 + channel MHz */
    uint8_t address[NRF_ADDRESS_BYTES];
    uint8_t retries; /* 0 to 15; without auto-ack there are none */
    bool auto_ack;   /* false for clones that cannot: no retries, fixed payload width */
} nrf24_config;

typedef enum { NRF24_TRANSMITTER, NRF24_RECEIVER } nrf24_role;

typedef enum {
    NRF24_POWER_UP,
    NRF24_CONFIGURE,
    NRF24_STARTING, /* crystal and regulators */
    NRF24_READY,
    NRF24_DOWN /* powered down on purpose */
} nrf24_state;

typedef struct {
    const nrf24_config *config;
    nrf24_role role;
    nrf24_state state;
    uint8_t queued;          /* frames with the chip */
    uint8_t newest[NRF_PAYLOAD]; /* the last of them, should a flush take it with the one before */
    uint32_t sent_us;        /* when the older of them began */
    uint8_t retransmissions; /* of the last frame */
    uint8_t given_up;        /* frames that did not get through; this and the next three stay at 255 */
    uint8_t stuck;           /* chip gave no answer, or kept its FIFO after a flush */
    uint8_t restarts;        /* registers were lost: set up anew */
    uint8_t bad_width;       /* receptions with an impossible width: flushed */
    uint8_t stuck_in_row;
} nrf24;

typedef enum { NRF24_NOTHING, NRF24_PAYLOAD, NRF24_BAD } nrf24_reception;

void nrf24_init(nrf24 *radio, const nrf24_config *config, nrf24_role role);

/* One step of the set-up. Returns the us until the next one, 0 once NRF24_READY (and in NRF24_DOWN). */
uint32_t nrf24_setup_step(nrf24 *radio);

/* Transmitter. `send` wants room (nrf24_make_room); a radio that is not ready gives the frame up. */
void nrf24_send(nrf24 *radio, const uint8_t payload[NRF_PAYLOAD]);
/* Looks without waiting whether frames are still with the chip, and books the outcome of those that are not. After MAX_RT
 * the chip can only be flushed; the frame behind is then written once more. */
bool nrf24_busy(nrf24 *radio);
void nrf24_finish(nrf24 *radio);
void nrf24_make_room(nrf24 *radio);

/* Receiver: takes the oldest payload out of the chip's FIFO. */
nrf24_reception nrf24_receive(nrf24 *radio, uint8_t payload[NRF_PAYLOAD]);

/* Reads the essential registers back; false when they were lost: then set-up starts over. Not while sending. */
bool nrf24_verify(nrf24 *radio);

/* 1 uA until nrf24_power_up, after which nrf24_setup_step has to run again (first in NRF24_START_US). */
void nrf24_power_down(nrf24 *radio);
void nrf24_power_up(nrf24 *radio);

#define NRF24_START_US 5000u /* 4.5 ms with a crystal of 90 mH, 1.5 ms with most */

#endif
