/* The receiver's serial line, played by a pseudo-terminal. Whole packets only: what finds no reader is dropped (oldest
 * first) and counted, never torn, and never waited for. */
#ifndef GSENSE_PTY_LINK_H
#define GSENSE_PTY_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "truth.h"

#define PTY_PATH_SIZE 128u
#define PTY_PACKET_SIZE 40u
#define PTY_QUEUE 128u /* packets: 0.4 s at 300 frames a second, on top of the terminal's own 4 KB */

typedef struct {
    uint8_t bytes[PTY_PACKET_SIZE];
    uint8_t size;
    uint64_t due_ns; /* not before this, CLOCK_MONOTONIC */
    packet_truth truth;
} pty_packet;

typedef struct {
    int master;
    int slave; /* kept open, so that a reader may come and go */
    char path[PTY_PATH_SIZE];
    const char *link; /* symbolic link to the path, or NULL */
    pty_packet queue[PTY_QUEUE];
    size_t first;
    size_t waiting;
    size_t sent_of_first; /* bytes of the first packet that the terminal already took */
    uint64_t dropped;
    packet_truth dropped_last; /* the newest was dropped, for the next one to tell */
    bool has_dropped_last;
    truth delivered;
} pty_link;

/* False, with a line on stderr, when there is no pseudo-terminal or the link cannot be made. */
bool pty_open(pty_link *pty, const char *link);
void pty_send(pty_link *pty, const pty_packet *packet);
/* Moves packets that are due to the terminal as far as there is room; throws away what a reader wrote. */
void pty_service(pty_link *pty, uint64_t now_ns);
/* When the next packet is due; UINT64_MAX: none waits. */
uint64_t pty_next_due(const pty_link *pty);
/* Bytes that the terminal holds for a reader; waits until the kernel has passed on what was sent to it. */
size_t pty_unread(const pty_link *pty);
/* Bytes that a reader has not taken yet, in packets and in the terminal. */
size_t pty_left(const pty_link *pty);
/* Removes the link if it is still ours. */
void pty_close(pty_link *pty);

#endif
