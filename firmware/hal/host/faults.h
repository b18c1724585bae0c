/* Faults on demand: what the options ask for, and the line between receiver and pseudo-terminal with its own ones. */
#ifndef GSENSE_FAULTS_H
#define GSENSE_FAULTS_H

#include <stdbool.h>
#include <stdint.h>

#include "chance.h"
#include "pty_link.h"

#define FAULTS_FROM_NS 1000000000u /* random faults wait for the driver to have found the stream */
#define FAULT_BROWNOUTS 8u

typedef struct {
    bool wanted;
    double at_s; /* of the board's clock since power-on */
    double duration_s;
} fault_window;

typedef struct {
    double lose;
    double repeat;
    double flip;
    double air_loss;
    double latency_ms; /* longest distance of two bursts, 0: none */
    fault_window sda_low;
    fault_window stretch;
    fault_window radio_stuck;
    fault_window radio_reset;
    double brownouts_s[FAULT_BROWNOUTS];
    unsigned brownouts;
    bool real_delay; /* SPI, air and UART take their time */
    const char *truth_path;
} fault_options;

bool faults_any(const fault_options *options);
static inline bool fault_window_holds(const fault_window *window, uint64_t board_ns)
{
    const double at = (double)board_ns / 1e9;
    return window->wanted && at >= window->at_s && at < window->at_s + window->duration_s;
}

/* The receiver's serial line. */
typedef struct {
    const fault_options *options;
    chance flip_stream;
    chance burst_stream;
    uint64_t free_ns;  /* the UART is busy until then */
    uint64_t burst_ns; /* the next one */
    uint64_t last_due_ns;
    bool broken_delimiter; /* the packet before runs into this one */
    bool has_last;
    uint8_t last[32];
    bool restarted;
} line;

void line_init(line *l, const fault_options *options, uint32_t seed);
/* The board restarted: the next packet is its first. */
void line_restarted(line *l);
/* One COBS packet of `payload`, wished out at `due_ns`. `random`: random faults may strike; `repeated`: another copy of it
 * comes or came (then it is not flipped, so that every loss stays countable). */
void line_send(line *l, pty_link *pty, const uint8_t payload[32], const uint8_t *packet, uint8_t size, uint64_t due_ns,
               bool random, bool repeated);

#endif
