#include "sample_clock.h"

#include <string.h>

#include "counters.h"

#define GATE_MIN_US 128u
#define LOOK_SLACK_US 400u /* a look may have to wait for another one's transfer */
#define LOST_SAMPLES_BITS 6u /* 64 samples */

/* value / 2^bits, towards zero, by shifts: a division of 32 bits takes an 8-bit CPU as long as a short transfer. */
static int32_t fraction(int32_t value, uint8_t bits)
{
    if (value < 0) {
        return -(int32_t)((uint32_t)-value >> bits);
    }
    return (int32_t)((uint32_t)value >> bits);
}

void sample_clock_init(sample_clock *c, uint32_t nominal_us)
{
    memset(c, 0, sizeof *c);
    c->nominal_us = nominal_us;
    c->gate_us = (uint16_t)(nominal_us / 16u);
}

static uint32_t period(const sample_clock *c)
{
    if (c->trim >= 0) {
        return c->nominal_us + (uint32_t)c->trim / 16u;
    }
    return c->nominal_us - (uint32_t)(-c->trim) / 16u;
}

static void widen(sample_clock *c)
{
    const uint32_t widest = c->nominal_us / 4u;
    if (2u * (uint32_t)c->gate_us < widest) {
        c->gate_us = (uint16_t)(2u * c->gate_us);
    } else {
        c->gate_us = (uint16_t)widest;
    }
}

static void narrow(sample_clock *c)
{
    c->gate_us = (uint16_t)(c->gate_us / 2u);
    if (c->gate_us < GATE_MIN_US) {
        c->gate_us = GATE_MIN_US;
    }
}

/* The edge was `error_us` after the prediction: a 16th of it is taken for a wrong period, less where the prediction was
 * itself a guess (the middle of a wide interval). */
static void trim_period(sample_clock *c, int32_t error_us)
{
    const int32_t limit = (int32_t)c->nominal_us; /* in 1/16 us: the chip's clock is within 1/16 of nominal */
    int32_t step = error_us;
    if (c->guessed) {
        step = fraction(error_us, 2);
    }
    c->trim += step;
    if (c->trim > limit) {
        c->trim = limit;
    } else if (c->trim < -limit) {
        c->trim = -limit;
    } else {
        /* plausible */
    }
}

static void consume_edge(sample_clock *c, uint32_t at)
{
    c->newest_us = at;
    c->edge_us = at + period(c);
    c->late_step_us = GATE_MIN_US / 2u;
}

/* The edge lies in (looked, now], and the prediction does too: draw it to the middle, gently where the interval is wide. */
static void on_agreement(sample_clock *c, uint32_t edge, uint32_t now)
{
    const uint32_t width = now - c->looked_us;
    const uint32_t middle = c->looked_us + width / 2u;
    const int32_t error = (int32_t)(middle - edge); /* two's complement: negative where the middle came first */
    int32_t pull = fraction(error, 5);
    c->guessed = width > 4u * GATE_MIN_US;
    if (!c->guessed) {
        pull = fraction(error, 2);
        trim_period(c, fraction(error, 3));
    }
    if (edge - c->looked_us <= c->gate_us + LOOK_SLACK_US) {
        narrow(c);
    } else { /* nobody looked shortly before: the edge may have come much earlier */
        widen(c);
        pull = 0;
    }
    consume_edge(c, edge + (uint32_t)pull);
}

static void on_change(sample_clock *c, uint32_t now)
{
    uint32_t edge = c->edge_us;
    while (time_reached(now, edge + period(c))) { /* not looked for some samples: fewer than 64 */
        edge += period(c);
    }
    if (!time_reached(now + c->nominal_us / 2u, edge)) {
        edge -= period(c); /* the sample before was taken for an equal one and comes only now */
    }
    if (!time_reached(now, edge)) { /* came before it was due */
        trim_period(c, -(int32_t)(edge - now));
        widen(c);
        consume_edge(c, now);
    } else if (time_reached(c->looked_us, edge)) { /* was due, but not there at the last look */
        trim_period(c, (int32_t)(c->looked_us - edge));
        widen(c);
        uint32_t half = (now - c->looked_us) / 2u;
        if (half > c->gate_us) {
            half = c->gate_us;
        }
        consume_edge(c, c->looked_us + half);
    } else {
        on_agreement(c, edge, now);
    }
}

static void on_no_change(sample_clock *c, uint32_t now)
{
    if (!time_reached(now, c->edge_us)) {
        return;
    }
    /* Once the gate is narrow the prediction is trusted: the sample has come, with the bytes of the one before. */
    uint32_t patience = c->nominal_us / 2u;
    if (c->gate_us <= 2u * GATE_MIN_US) {
        patience = 4u * (uint32_t)c->gate_us;
    }
    if (now - c->edge_us >= patience) {
        consume_edge(c, c->edge_us);
    } else {
        c->late_step_us = (uint16_t)(2u * c->late_step_us);
    }
}

void sample_clock_look(sample_clock *c, uint32_t now, const uint8_t bytes[SAMPLE_BYTES])
{
    const bool changed = memcmp(c->last, bytes, SAMPLE_BYTES) != 0;
    memcpy(c->last, bytes, SAMPLE_BYTES);
    if (!c->started || (uint32_t)(now - c->looked_us) > c->nominal_us << LOST_SAMPLES_BITS) {
        c->started = changed; /* nobody looked for long: start over rather than count edges up */
        consume_edge(c, now);
    } else if (changed) {
        on_change(c, now);
    } else {
        on_no_change(c, now);
    }
    c->looked_us = now;
}

uint32_t sample_clock_next_look(const sample_clock *c)
{
    const uint32_t before = c->edge_us - c->gate_us;
    if (!time_reached(c->looked_us, before)) {
        return before;
    }
    if (!time_reached(c->looked_us, c->edge_us)) {
        return c->edge_us + c->gate_us;
    }
    return c->looked_us + c->late_step_us;
}

uint16_t sample_clock_age(const sample_clock *c, uint32_t now)
{
    if (!c->started) {
        return 0;
    }
    return saturate_u16(now - c->newest_us);
}
