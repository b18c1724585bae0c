#include "air.h"

#include <string.h>

#define SETTLE_NS 130000u
#define PACKET_NS 164500u /* 329 bits: preamble, address, 9 bits of control, payload, CRC */
#define ACK_NS 166500u    /* turn-around and 73 bits */
#define RETRY_NS 414500u  /* packet and ARD */
#define ARD_NS 250000u

enum { STREAM_LOSE = 10, STREAM_REPEAT, STREAM_ATTEMPT };

void air_init(air *a, uint32_t seed)
{
    memset(a, 0, sizeof *a);
    nrf_chip_reset(&a->sender);
    nrf_chip_reset(&a->receiver);
    a->lose_stream = chance_stream(seed, STREAM_LOSE);
    a->repeat_stream = chance_stream(seed, STREAM_REPEAT);
    a->attempt_stream = chance_stream(seed, STREAM_ATTEMPT);
}

static bool acknowledges(const nrf_chip *chip) { return (chip->registers[NRF_EN_AA] & 1u) != 0; }

static bool listens(const air *a, uint64_t now_ns)
{
    const nrf_chip *to = &a->receiver;
    const nrf_chip *from = &a->sender;
    return nrf_chip_is_up(to, now_ns) && to->ce && (to->registers[NRF_CONFIG] & NRF_CONFIG_PRIM_RX) != 0 &&
           to->registers[NRF_RF_CH] == from->registers[NRF_RF_CH] &&
           to->registers[NRF_RF_SETUP] == from->registers[NRF_RF_SETUP] && acknowledges(to) == acknowledges(from) &&
           memcmp(to->rx_address, from->tx_address, NRF_ADDRESS_BYTES) == 0;
}

/* One packet reaches the receiver's chip. False: no room, and so no acknowledgement. */
static bool hear(nrf_chip *chip, const nrf_payload *payload, uint8_t pid, bool twice, bool *is_new)
{
    const bool same = acknowledges(chip) && chip->has_last && chip->last_pid == pid &&
                      memcmp(&chip->last, payload, sizeof *payload) == 0;
    *is_new = false;
    if (!same) {
        if (!nrf_chip_push_rx(chip, payload)) {
            return false;
        }
        *is_new = true;
        if (twice) {
            (void)nrf_chip_push_rx(chip, payload);
        }
    }
    chip->has_last = true;
    chip->last_pid = pid;
    chip->last = *payload;
    return true;
}

static bool begin(air *a, uint64_t now_ns)
{
    nrf_chip *from = &a->sender;
    const bool ack = acknowledges(from);
    const unsigned tries = ack ? 1u + (from->registers[NRF_SETUP_RETR] & 0x0Fu) : 1u;
    const bool lose = chance_of(&a->lose_stream, a->lose) || a->stuck;
    const bool twice = chance_of(&a->repeat_stream, a->repeat);
    bool delivered = false;
    bool acknowledged = false;
    unsigned tried = 0;
    from->pid = (uint8_t)((from->pid + 1u) & 3u);
    while (tried < tries && !acknowledged) {
        const uint64_t heard_ns = now_ns + SETTLE_NS + PACKET_NS + tried * (uint64_t)RETRY_NS;
        const bool packet_lost = chance_of(&a->attempt_stream, a->attempt) || lose || !listens(a, now_ns);
        const bool ack_lost = chance_of(&a->attempt_stream, a->attempt);
        bool is_new = false;
        if (!packet_lost && hear(&a->receiver, &from->tx[0], from->pid, twice, &is_new)) {
            acknowledged = ack && !ack_lost;
            if (is_new) {
                a->heard_ns = heard_ns;
                a->heard_twice = twice;
            }
            delivered = delivered || is_new;
        }
        ++tried;
    }
    const uint64_t retries_ns = (uint64_t)(tried - 1u) * RETRY_NS;
    from->in_flight = true;
    from->retransmissions = (uint8_t)(tried - 1u);
    from->outcome = acknowledged || !ack ? NRF_STATUS_TX_DS : NRF_STATUS_MAX_RT;
    from->done_ns = a->stuck ? UINT64_MAX
                             : now_ns + SETTLE_NS + PACKET_NS + retries_ns + (acknowledged ? ACK_NS : ack ? ARD_NS : 0u);
    ++a->frames;
    a->attempts += tried;
    a->undelivered += delivered ? 0u : 1u;
    return delivered;
}

static void end(nrf_chip *from)
{
    from->in_flight = false;
    from->registers[NRF_STATUS] |= from->outcome;
    from->registers[NRF_OBSERVE_TX] = (uint8_t)((from->registers[NRF_OBSERVE_TX] & 0xF0u) | from->retransmissions);
    if (from->outcome == NRF_STATUS_TX_DS) {
        nrf_chip_pop_tx(from); /* after MAX_RT the payload stays */
    }
}

static bool may_begin(const nrf_chip *from, uint64_t now_ns)
{
    return !from->in_flight && from->ce && from->tx_count > 0 && nrf_chip_is_up(from, now_ns) &&
           (from->registers[NRF_CONFIG] & NRF_CONFIG_PRIM_RX) == 0 && (from->registers[NRF_STATUS] & NRF_STATUS_MAX_RT) == 0;
}

bool air_advance(air *a, uint64_t now_ns)
{
    nrf_chip *from = &a->sender;
    uint64_t start_ns = now_ns;
    if (from->in_flight && now_ns >= from->done_ns) {
        end(from);
        start_ns = from->done_ns; /* the next one was waiting */
    }
    return may_begin(from, start_ns) && begin(a, start_ns);
}
