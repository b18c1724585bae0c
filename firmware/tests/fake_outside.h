/* What stands around the emulated chip in its own tests: nothing that moves by itself. */
#ifndef GSENSE_FAKE_OUTSIDE_H
#define GSENSE_FAKE_OUTSIDE_H

#include <stdbool.h>
#include <stdint.h>

#include "outside.h"

struct outside {
    /* answers */
    bool acknowledges;
    uint8_t i2c_bytes[8];
    unsigned i2c_given;
    uint64_t scl_until;
    bool sda_low;
    uint8_t spi_answer;
    uint16_t adc_code;
    uint32_t pins_high; /* inputs, by pin */
    /* what came */
    uint8_t i2c_sent[8];
    unsigned i2c_count;
    unsigned starts;
    unsigned stops;
    unsigned acks;
    unsigned nacks;
    uint8_t spi_sent[8];
    unsigned spi_count;
    unsigned adc_channel;
    uint8_t uart[16];
    uint64_t uart_ns[16];
    unsigned uart_count;
    unsigned resets;
    uint32_t driven_high; /* by pin */
    uint32_t driven_low;
};

#endif
