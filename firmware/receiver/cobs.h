/* Consistent Overhead Byte Stuffing (Cheshire and Baker 1999): no zero in a packet, so that a zero can close it. */
#ifndef GSENSE_COBS_H
#define GSENSE_COBS_H

#include <stddef.h>
#include <stdint.h>

/* Longest packet for `length` bytes, closing zero included. */
#define COBS_PACKET_SIZE(length) ((length) + (length) / 254u + 2u)

/* Writes the packet with its closing 0x00 to `packet` (COBS_PACKET_SIZE(length) bytes); returns its size. */
size_t cobs_encode(const uint8_t *data, size_t length, uint8_t *packet);

/* Decodes what stood before a closing zero into `data` (room for `length` bytes). Returns the size, or SIZE_MAX when the
 * code bytes do not fit the length or there is a zero inside. */
size_t cobs_decode(const uint8_t *packet, size_t length, uint8_t *data);

#endif
