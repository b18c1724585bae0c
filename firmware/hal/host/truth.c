#include "truth.h"

void truth_deliver(truth *t, const packet_truth *packet)
{
    t->gap += packet->lost_before;
    t->restarted = t->restarted || packet->restart;
    if (packet->kind == PACKET_CORRUPT) {
        ++t->corrupt;
        return;
    }
    if (packet->kind == PACKET_DUPLICATE) {
        ++t->duplicate;
        return;
    }
    const bool first = t->received == 0;
    if (first || t->restarted) {
        t->unknowable += t->gap;
        t->restarts += first ? 0u : 1u;
    } else {
        t->lost += t->gap;
    }
    ++t->received;
    t->gap = 0;
    t->restarted = false;
}

void truth_drop(const packet_truth *gone, packet_truth *next)
{
    next->lost_before += gone->lost_before;
    next->restart = next->restart || gone->restart;
    if (gone->kind != PACKET_DUPLICATE && next->kind == PACKET_DUPLICATE) {
        next->kind = PACKET_GOOD; /* the copy is the one that arrives */
    } else if (gone->kind != PACKET_DUPLICATE) {
        ++next->lost_before;
    }
}
