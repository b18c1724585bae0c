/* How old the BNO055's sample is. The chip has no data-ready line in AMG and runs on its own clock (some % off), so the age
 * follows from change detection: every look at the gyro's bytes tells whether a sample came since the look before.
 *
 * The tracker predicts the next change (`edge`) and asks for two short looks around it, `gate` before and after. A change
 * between two near looks is a measurement: it corrects prediction and period, and the gate halves. A change without a look
 * just before it only bounds the edge: the gate doubles until there is one. All in integers. A sample with the bytes of its
 * predecessor goes by without a correction. An edge that falls where another job keeps the bus busy is known to that job's
 * length.
 */
#ifndef GSENSE_SAMPLE_CLOCK_H
#define GSENSE_SAMPLE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#define SAMPLE_BYTES 6u

typedef struct {
    uint32_t edge_us;    /* predicted time of the next change */
    uint32_t newest_us;  /* estimated time of the sample now in the registers */
    uint32_t looked_us;  /* time of the last look */
    uint32_t nominal_us; /* period from the configuration */
    int32_t trim;        /* measured period minus nominal, in 1/16 us */
    uint16_t gate_us;
    uint16_t late_step_us; /* distance of the looks for an edge that is overdue */
    bool guessed; /* the last change was between looks far apart */
    bool started;
    uint8_t last[SAMPLE_BYTES];
} sample_clock;

void sample_clock_init(sample_clock *c, uint32_t nominal_us);

/* A look at `now` (board time at the start of the read) found these bytes. */
void sample_clock_look(sample_clock *c, uint32_t now, const uint8_t bytes[SAMPLE_BYTES]);

/* When the next extra look is worth most; may be past already. */
uint32_t sample_clock_next_look(const sample_clock *c);

/* Age at `now` of the sample found by the last look, us, at most 65535; 0 before the first change was seen. */
uint16_t sample_clock_age(const sample_clock *c, uint32_t now);

#endif
