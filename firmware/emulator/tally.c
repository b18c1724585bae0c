#include "tally.h"

#include <stdbool.h>
#include <string.h>

#include "cobs.h"
#include "frame.h"

#define UPTIME 24u
#define MPU_PERIOD 20u
#define BNO_PERIOD 22u
#define RESET_CAUSE 18u
#define RESTART_GAP 0x8000u /* a sequence that goes back */

typedef struct {
    bool any;
    uint16_t sequence;
    bool any_mpu;
    uint32_t mpu_us;
    bool any_bno;
    uint32_t bno_us;
    int32_t phase_us; /* of the MPU reads against a grid that starts with the first */
    int32_t earliest;
    int32_t latest;
} course;

static uint16_t u16(const uint8_t *at) { return (uint16_t)(at[0] | at[1] << 8); }

static uint32_t u32(const uint8_t *at) { return u16(at) | (uint32_t)u16(at + 2) << 16; }

static void see_status(tally *t, const uint8_t *frame)
{
    t->mpu_period_us = u16(frame + MPU_PERIOD);
    t->bno_period_us = u16(frame + BNO_PERIOD);
    t->reset_cause = frame[RESET_CAUSE];
}

/* Slots from one frame to the next of its kind, to the nearest. */
static int32_t slots_between(uint32_t before, uint32_t now, int32_t period)
{
    return ((int32_t)(now - before) + period / 2) / period;
}

static void see_mpu(tally *t, course *c, const uint8_t *frame)
{
    const uint32_t now = u32(frame + 4);
    const int32_t period = t->mpu_period_us;
    t->given_up = frame[26];
    t->i2c_errors = frame[27];
    if (c->any_mpu && period > 0) {
        const int32_t slots = slots_between(c->mpu_us, now, period);
        t->overruns += slots > 1 ? (uint64_t)(slots - 1) : 0u;
        c->phase_us += (int32_t)(now - c->mpu_us) - slots * period;
        c->earliest = c->phase_us < c->earliest ? c->phase_us : c->earliest;
        c->latest = c->phase_us > c->latest ? c->phase_us : c->latest;
        t->mpu_late_us = (uint32_t)(c->latest - c->earliest);
    }
    c->any_mpu = true;
    c->mpu_us = now;
}

static void see_bno(tally *t, course *c, const uint8_t *frame)
{
    const uint32_t now = u32(frame + 4);
    if (c->any_bno && t->bno_period_us > 0) {
        const int32_t slots = slots_between(c->bno_us, now, t->bno_period_us);
        t->overruns += slots > 1 ? (uint64_t)(slots - 1) : 0u;
    }
    c->any_bno = true;
    c->bno_us = now;
}

static void see_sequence(tally *t, course *c, const uint8_t *frame)
{
    const uint16_t sequence = u16(frame + 2);
    const uint16_t gap = (uint16_t)(sequence - c->sequence - 1u);
    if (!c->any) {
        t->lost += sequence; /* the first is number 0 */
    } else if (gap < RESTART_GAP) {
        t->lost += gap;
    } else {
        ++t->restarts;
        memset(c, 0, sizeof *c);
        t->lost += sequence;
    }
    c->any = true;
    c->sequence = sequence;
}

void tally_count(tally *t, const growing *frames)
{
    const heard_frame *items = frames->items;
    course c = {0};
    memset(t, 0, sizeof *t);
    for (size_t i = 0; i < frames->count; ++i) {
        const uint8_t *frame = items[i].bytes;
        ++t->frames;
        if (!frame_is_sound(frame)) {
            ++t->unsound;
            continue;
        }
        const unsigned type = frame[0] & 31u;
        t->by_type[type < TALLY_TYPES ? type : 0] += 1u;
        t->failed += frame[1] & FRAME_FLAG_READ_FAILED;
        see_sequence(t, &c, frame);
        if (type == FRAME_STATUS) {
            see_status(t, frame);
        } else if (type == FRAME_MPU) {
            see_mpu(t, &c, frame);
        } else {
            see_bno(t, &c, frame);
        }
    }
}

/* One packet against the frames that were sent; those that it passes over are missing. */
static void see_packet(line_tally *t, const growing *sent, size_t *next, const uint8_t *packet, size_t size,
                       uint64_t end_ns)
{
    uint8_t frame[COBS_PACKET_SIZE(FRAME_SIZE)];
    const heard_frame *items = sent->items;
    ++t->packets;
    if (size > sizeof frame || cobs_decode(packet, size, frame) != FRAME_SIZE || !frame_is_sound(frame)) {
        ++t->unsound;
        return;
    }
    size_t at = *next;
    while (at < sent->count && memcmp(items[at].bytes, frame, FRAME_SIZE) != 0) {
        ++at;
    }
    if (at == sent->count) {
        ++t->unsound;
        return;
    }
    t->missing += at - *next;
    *next = at + 1u;
    const uint64_t took = end_ns - items[at].ns;
    t->longest_ns = took > t->longest_ns ? took : t->longest_ns;
    t->shortest_ns = t->shortest_ns == 0 || took < t->shortest_ns ? took : t->shortest_ns;
}

void tally_line(line_tally *t, const growing *sent, const growing *bytes)
{
    const serial_byte *items = bytes->items;
    uint8_t packet[COBS_PACKET_SIZE(FRAME_SIZE)];
    size_t size = 0;
    size_t next = 0;
    memset(t, 0, sizeof *t);
    for (size_t i = 0; i < bytes->count; ++i) {
        const uint64_t step = i > 0 ? items[i].ns - items[i - 1].ns : 0;
        t->baud_ns = i > 0 && (t->baud_ns == 0 || step < t->baud_ns) ? step : t->baud_ns;
        if (items[i].byte != 0) {
            packet[size % sizeof packet] = items[i].byte;
            ++size;
        } else {
            see_packet(t, sent, &next, packet, size, items[i].ns + t->baud_ns);
            size = 0;
        }
    }
    t->missing += sent->count - next;
}
