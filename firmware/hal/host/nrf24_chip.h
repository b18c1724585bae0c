/* The nRF24L01+ as its SPI pins show it: registers, three-level FIFOs, flags. What happens on the air is air.h's matter. */
#ifndef GSENSE_NRF24_CHIP_H
#define GSENSE_NRF24_CHIP_H

#include <stdbool.h>
#include <stdint.h>

#include "nrf24_registers.h"

typedef struct {
    uint8_t bytes[NRF_PAYLOAD];
    uint8_t size;
} nrf_payload;

typedef struct {
    uint8_t registers[NRF_REGISTERS]; /* of multi-byte ones the first byte */
    uint8_t rx_address[NRF_ADDRESS_BYTES];
    uint8_t tx_address[NRF_ADDRESS_BYTES];
    nrf_payload tx[NRF_FIFO_DEPTH];
    nrf_payload rx[NRF_FIFO_DEPTH];
    uint8_t tx_count;
    uint8_t rx_count;
    bool ce;
    uint64_t ready_ns; /* when PWR_UP has taken effect */
    /* a transmission under way, decided when it began, seen when it ends */
    bool in_flight;
    uint64_t done_ns;
    uint8_t outcome; /* NRF_STATUS_TX_DS or NRF_STATUS_MAX_RT */
    uint8_t retransmissions;
    uint8_t pid;
    /* receiver: what a packet received twice is known by */
    bool has_last;
    uint8_t last_pid;
    nrf_payload last;
} nrf_chip;

/* Power-on reset. */
void nrf_chip_reset(nrf_chip *chip);
/* One transaction; `out` is NULL for reads, `in` for writes. Returns STATUS. */
uint8_t nrf_chip_spi(nrf_chip *chip, uint64_t now_ns, uint8_t command, const uint8_t *out, uint8_t *in, uint8_t length);
bool nrf_chip_irq(const nrf_chip *chip);

bool nrf_chip_is_up(const nrf_chip *chip, uint64_t now_ns);
/* Removes the oldest payload of the FIFO to send. */
void nrf_chip_pop_tx(nrf_chip *chip);
/* False: FIFO full. */
bool nrf_chip_push_rx(nrf_chip *chip, const nrf_payload *payload);

#endif
