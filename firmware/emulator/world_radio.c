/* The two radios: one on the chip's SPI, the other far away and always well set up. */
#include <string.h>

#include "board.h"
#include "frame.h"
#include "world.h"

#define IDLE_TICK_NS 1000000u
#define NS_PER_S 1e9

nrf_chip *world_radio(struct outside *o) { return o->options.role == ROLE_BOARD ? &o->air.sender : &o->air.receiver; }

static nrf_chip *distant(struct outside *o)
{
    return o->options.role == ROLE_BOARD ? &o->air.receiver : &o->air.sender;
}

static void set_up_distant(struct outside *o)
{
    nrf_chip *radio = distant(o);
    const bool receives = o->options.role == ROLE_BOARD;
    radio->registers[NRF_CONFIG] =
        (uint8_t)(NRF_CONFIG_CRC_16 | NRF_CONFIG_PWR_UP | (receives ? NRF_CONFIG_PRIM_RX : 0u));
    radio->registers[NRF_EN_AA] = radio_config.auto_ack ? 1 : 0;
    radio->registers[NRF_SETUP_RETR] = radio_config.retries;
    radio->registers[NRF_RF_CH] = radio_config.channel;
    radio->registers[NRF_RF_SETUP] = NRF_RF_2_MBIT_0_DBM;
    memcpy(radio->rx_address, radio_config.address, NRF_ADDRESS_BYTES);
    memcpy(radio->tx_address, radio_config.address, NRF_ADDRESS_BYTES);
    radio->ce = true;
}

void world_init(struct outside *o, const world_options *options)
{
    memset(o, 0, sizeof *o);
    o->options = *options;
    air_init(&o->air, options->seed);
    set_up_distant(o);
    o->next_frame_ns = (uint64_t)NS_PER_S; /* the receiver has set up its radio by then */
}

/* The distant board: frames like the board's, in its fast profile's order. */
static void send_frame(struct outside *o)
{
    uint8_t registers[MPU_BURST];
    for (unsigned i = 0; i < MPU_BURST; ++i) {
        registers[i] = (uint8_t)(o->sequence * 31u + i * 7u);
    }
    const frame_mpu body = {registers, 8192, 3900, 0, 0, 0};
    const frame_header header = {FRAME_MPU, 0, o->sequence, (uint32_t)(o->next_frame_ns / 1000u)};
    heard_frame item = {o->next_frame_ns, {0}};
    frame_put_mpu(item.bytes, &body);
    frame_close(item.bytes, &header);
    nrf_chip *radio = distant(o);
    radio->registers[NRF_STATUS] &=
        (uint8_t)~NRF_STATUS_FLAGS; /* a frame that nobody took stays in front, as after MAX_RT */
    if (radio->tx_count == NRF_FIFO_DEPTH) {
        ++o->frames_refused;
    } else {
        (void)nrf_chip_spi(radio, o->next_frame_ns, NRF_W_TX_PAYLOAD, item.bytes, NULL, NRF_PAYLOAD);
        world_add(&o->frames, &item, sizeof item);
    }
    ++o->sequence;
    o->next_frame_ns += (uint64_t)(NS_PER_S / o->options.frames_per_s);
}

static void faults_at(struct outside *o, uint64_t ns)
{
    const fault_options *faults = &o->options.faults;
    const bool random = ns >= FAULTS_FROM_NS;
    o->air.lose = fault_window_holds(&o->options.deaf, ns) ? 1.0 : random ? faults->lose : 0.0;
    o->air.attempt = random ? faults->air_loss : 0.0;
    o->air.stuck = fault_window_holds(&faults->radio_stuck, ns);
    if (faults->radio_reset.wanted && !o->radio_was_reset && (double)ns >= faults->radio_reset.at_s * NS_PER_S) {
        o->radio_was_reset = true;
        nrf_chip_reset(world_radio(o));
    }
}

/* Takes what arrived far away. */
static void collect(struct outside *o)
{
    nrf_chip *radio = &o->air.receiver;
    while (radio->rx_count > 0) {
        heard_frame item = {o->air.heard_ns, {0}};
        (void)nrf_chip_spi(radio, o->air.heard_ns, NRF_R_RX_PAYLOAD, NULL, item.bytes, NRF_PAYLOAD);
        world_add(&o->frames, &item, sizeof item);
    }
}

void world_advance(struct outside *o, uint64_t ns)
{
    faults_at(o, ns);
    if (o->options.role == ROLE_RECEIVER && ns >= o->next_frame_ns &&
        (double)ns < o->options.frames_until_s * NS_PER_S) {
        send_frame(o);
    }
    do {
        if (air_advance(&o->air, ns) && o->options.role == ROLE_BOARD) {
            collect(o);
        }
    } while (o->air.sender.in_flight && o->air.sender.done_ns <= ns);
}

uint64_t world_next(struct outside *o, uint64_t ns)
{
    const nrf_chip *sender = &o->air.sender;
    uint64_t next = ns + IDLE_TICK_NS;
    if (sender->in_flight && sender->done_ns > ns && sender->done_ns < next) {
        next = sender->done_ns;
    }
    if (o->options.role == ROLE_RECEIVER && o->next_frame_ns > ns && o->next_frame_ns < next) {
        next = o->next_frame_ns;
    }
    return next;
}
