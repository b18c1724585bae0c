/* What the frames that arrived say: how many, which are missing, which slots were skipped. */
#ifndef GSENSE_EMULATOR_TALLY_H
#define GSENSE_EMULATOR_TALLY_H

#include <stdint.h>

#include "world.h"

#define TALLY_TYPES 5u

typedef struct {
    uint64_t frames;
    uint64_t by_type[TALLY_TYPES];
    uint64_t unsound;  /* version or CRC wrong */
    uint64_t lost;     /* gaps in the sequence */
    uint64_t failed;   /* flag "sensor read failed" */
    uint64_t overruns; /* MPU and BNO slots that were skipped, by the frames' times and the periods that STATUS tells */
    uint32_t restarts; /* uptime fell */
    uint16_t mpu_period_us;
    uint16_t bno_period_us;
    uint8_t reset_cause; /* of the last STATUS */
    uint8_t given_up;    /* of the last MPU frame */
    uint8_t i2c_errors;
    uint32_t mpu_late_us; /* an MPU read begins up to so much later than its grid's earliest */
} tally;

/* Of the receiver's line: packets that are one of the frames sent to it, in order. */
typedef struct {
    uint64_t packets;
    uint64_t unsound;
    uint64_t missing;     /* sent, but not in the line */
    uint64_t shortest_ns; /* from a frame's handing over to the distant radio to the end of its last byte */
    uint64_t longest_ns;
    uint64_t baud_ns; /* shortest distance of two bytes */
} line_tally;

void tally_count(tally *t, const growing *frames);
void tally_line(line_tally *t, const growing *sent, const growing *bytes);

#endif
