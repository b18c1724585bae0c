#include "cobs.h"

#include <stdbool.h>

#define LONGEST_RUN 0xFFu

size_t cobs_encode(const uint8_t *data, size_t length, uint8_t *packet)
{
    size_t code_at = 0;
    size_t end = 1;
    uint8_t code = 1;
    for (size_t i = 0; i < length; ++i) {
        if (data[i] != 0u) {
            packet[end++] = data[i];
            ++code;
        }
        const bool last = i + 1u == length;
        if (data[i] == 0u || (code == LONGEST_RUN && !last)) {
            packet[code_at] = code;
            code_at = end++;
            code = 1;
        }
    }
    packet[code_at] = code;
    packet[end++] = 0;
    return end;
}

size_t cobs_decode(const uint8_t *packet, size_t length, uint8_t *data)
{
    size_t size = 0;
    size_t at = 0;
    while (at < length) {
        const uint8_t code = packet[at];
        if (code == 0u || at + code > length) {
            return SIZE_MAX;
        }
        for (size_t i = 1; i < code; ++i) {
            if (packet[at + i] == 0u) {
                return SIZE_MAX;
            }
            data[size++] = packet[at + i];
        }
        at += code;
        if (code != LONGEST_RUN && at < length) {
            data[size++] = 0;
        }
    }
    return size;
}
