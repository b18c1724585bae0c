#include "faults.h"

#include <string.h>

#define UART_PACKET_NS 737847u /* 34 bytes of 10 bits at 460800 baud */
#define SPI_READ_NS 267000u    /* the receiver reads the payload out */

enum { STREAM_FLIP = 20, STREAM_BURST };

bool faults_any(const fault_options *o)
{
    return o->lose > 0 || o->repeat > 0 || o->flip > 0 || o->air_loss > 0 || o->latency_ms > 0 || o->sda_low.wanted ||
           o->stretch.wanted || o->radio_stuck.wanted || o->radio_reset.wanted || o->brownouts > 0;
}

void line_init(line *l, const fault_options *options, uint32_t seed)
{
    memset(l, 0, sizeof *l);
    l->options = options;
    l->flip_stream = chance_stream(seed, STREAM_FLIP);
    l->burst_stream = chance_stream(seed, STREAM_BURST);
}

void line_restarted(line *l) { l->restarted = true; }

static uint16_t sequence_of(const uint8_t payload[32]) { return (uint16_t)(payload[2] | (unsigned)payload[3] << 8); }

static packet_truth truth_of(line *l, const uint8_t payload[32])
{
    packet_truth t = {PACKET_GOOD, 0, l->restarted};
    const uint16_t sequence = sequence_of(payload);
    if (!l->has_last || l->restarted) {
        t.lost_before = sequence; /* the counter starts at 0 */
    } else if (memcmp(l->last, payload, 32) == 0) {
        t.kind = PACKET_DUPLICATE;
    } else {
        t.lost_before = (uint16_t)(sequence - sequence_of(l->last) - 1u);
    }
    l->has_last = true;
    l->restarted = false;
    memcpy(l->last, payload, 32);
    return t;
}

/* One bit of the packet; of its closing zero only where no copies could follow. */
static void maybe_flip(line *l, pty_packet *packet, bool allowed)
{
    const bool flip = chance_of(&l->flip_stream, l->options->flip);
    const uint64_t where = chance_bits(&l->flip_stream);
    const unsigned bytes = packet->size - (l->options->repeat > 0 ? 1u : 0u);
    if (l->broken_delimiter) {
        packet->truth.kind = PACKET_CORRUPT;
        l->broken_delimiter = false;
    }
    if (flip && allowed) {
        const unsigned bit = (unsigned)(where % (bytes * 8u));
        packet->bytes[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        packet->truth.kind = PACKET_CORRUPT;
        l->broken_delimiter = bit / 8u == packet->size - 1u;
    }
}

static uint64_t with_delays(line *l, uint64_t due_ns)
{
    if (l->options->real_delay) {
        const uint64_t ready = due_ns + SPI_READ_NS;
        l->free_ns = (ready > l->free_ns ? ready : l->free_ns) + UART_PACKET_NS;
        due_ns = l->free_ns;
    }
    if (l->options->latency_ms > 0) {
        while (l->burst_ns < due_ns) {
            const uint64_t step = (uint64_t)(chance_part(&l->burst_stream) * l->options->latency_ms * 1e6) + 1u;
            l->burst_ns = (l->burst_ns == 0 ? due_ns : l->burst_ns) + step;
        }
        due_ns = l->burst_ns;
    }
    l->last_due_ns = due_ns > l->last_due_ns ? due_ns : l->last_due_ns;
    return l->last_due_ns;
}

void line_send(line *l, pty_link *pty, const uint8_t payload[32], const uint8_t *bytes, uint8_t size, uint64_t due_ns,
               bool random, bool repeated)
{
    pty_packet packet = {.size = size, .truth = truth_of(l, payload)};
    memcpy(packet.bytes, bytes, size);
    maybe_flip(l, &packet, random && !repeated);
    packet.due_ns = with_delays(l, due_ns);
    pty_send(pty, &packet);
}
