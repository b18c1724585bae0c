/* What the serial line really carried, for comparison with what the driver counts (LinkStatus).
 *
 * Counted when a packet is out whole, in the driver's terms: a gap is only known once a sound frame follows it, and what was
 * lost before a restart, or between it and the first sound frame, nobody can know. */
#ifndef GSENSE_TRUTH_H
#define GSENSE_TRUTH_H

#include <stdbool.h>
#include <stdint.h>

typedef enum { PACKET_GOOD, PACKET_DUPLICATE, PACKET_CORRUPT } packet_kind;

typedef struct {
    packet_kind kind;
    uint32_t lost_before; /* frames between the packet before and this one that never came to the line */
    bool restart;         /* first of the board after a restart */
} packet_truth;

typedef struct {
    uint64_t received;
    uint64_t lost;
    uint64_t corrupt;
    uint64_t duplicate;
    uint64_t restarts;
    uint64_t unknowable;
    uint64_t gap;  /* lost since the last sound frame */
    bool restarted; /* since the last sound frame */
} truth;

void truth_deliver(truth *t, const packet_truth *packet);
/* `gone` was thrown away before it was sent: its frame is missing before `next`. */
void truth_drop(const packet_truth *gone, packet_truth *next);

#endif
