#include "hexfile.h"

#include <stdio.h>
#include <string.h>

#define LINE 600u
#define FIRST_CONFIG 0x8007u

typedef struct {
    uint8_t bytes[256];
    unsigned count;
} record;

static int digit(char c)
{
    const char *digits = "0123456789ABCDEF";
    const char *at = c == '\0' ? NULL : strchr(digits, c >= 'a' && c <= 'f' ? c - 'a' + 'A' : c);
    return at == NULL ? -1 : (int)(at - digits);
}

/* The bytes between colon and end, the checksum last. */
static bool parse(const char *line, record *r)
{
    r->count = 0;
    if (line[0] != ':') {
        return false;
    }
    unsigned total = 0;
    for (const char *c = line + 1; digit(c[0]) >= 0 && digit(c[1]) >= 0 && r->count < sizeof r->bytes; c += 2) {
        const int byte = digit(c[0]) * 16 + digit(c[1]);
        r->bytes[r->count] = (uint8_t)byte;
        total += r->bytes[r->count++];
    }
    return r->count >= 5u && r->count == r->bytes[0] + 5u && (total & 0xFFu) == 0;
}

static bool put_byte(pic *p, uint32_t address, uint8_t byte)
{
    const uint32_t at = address / 2u;
    uint16_t *word = NULL;
    if (at < PIC_WORDS) {
        word = &p->words[at];
    } else if (at >= FIRST_CONFIG && at < FIRST_CONFIG + PIC_CONFIGS) {
        word = &p->config[at - FIRST_CONFIG];
    } else {
        /* user ids, or nothing */
    }
    if (word == NULL) {
        return at >= 0x8000u && at < FIRST_CONFIG; /* user ids */
    }
    const unsigned shift = address % 2u == 0 ? 0u : 8u;
    *word = (uint16_t)((*word & (0xFF00u >> shift)) | (unsigned)byte << shift);
    return true;
}

/* NULL, or what is wrong with the record. */
static const char *take(pic *p, const record *r, uint32_t *high, bool *ended)
{
    const unsigned length = r->bytes[0];
    const uint32_t low = (uint32_t)r->bytes[1] << 8 | r->bytes[2];
    switch (r->bytes[3]) {
    case 0:
        for (unsigned i = 0; i < length; ++i) {
            if (!put_byte(p, *high + low + i, r->bytes[4 + i])) {
                return "an address that the PIC16F15356 does not have";
            }
        }
        return NULL;
    case 1:
        *ended = true;
        return NULL;
    case 4:
        *high = ((uint32_t)r->bytes[4] << 8 | r->bytes[5]) << 16;
        return NULL;
    default:
        return "a record type that is none of 0, 1, 4";
    }
}

bool hexfile_load(pic *p, const char *path, char *error, unsigned error_size)
{
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        (void)snprintf(error, error_size, "%s: cannot be read", path);
        return false;
    }
    char line[LINE];
    const char *fault = NULL;
    uint32_t high = 0;
    bool ended = false;
    unsigned number = 0;
    while (fault == NULL && !ended && fgets(line, (int)sizeof line, file) != NULL) {
        record r;
        ++number;
        fault = parse(line, &r) ? take(p, &r, &high, &ended) : "no record of Intel hex, or a wrong checksum";
    }
    (void)fclose(file);
    if (fault == NULL && !ended) {
        fault = "the end record is missing";
    }
    if (fault != NULL) {
        (void)snprintf(error, error_size, "%s:%u: %s", path, number, fault);
    }
    return fault == NULL;
}
