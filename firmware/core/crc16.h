/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected, no final xor; "123456789" gives 0x29B1. */
#ifndef GSENSE_CRC16_H
#define GSENSE_CRC16_H

#include <stdint.h>

#define CRC16_START 0xFFFFu

uint16_t crc16(const uint8_t *data, uint8_t length);

#endif
