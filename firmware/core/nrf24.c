#include "nrf24.h"

#include <string.h>

#include "config.h"
#include "counters.h"
#include "hal.h"

#define POWER_ON_US 100000u
#define MOST_POLLS 5000u /* of the IRQ line while waiting: ends the wait even if the timer stands still */
#define STUCK_BEFORE_SETUP 2u
#define MOST_QUEUED 2u
#define ADDRESS_WIDTH_5 3u

static void put(uint8_t reg, uint8_t value) { (void)hal_radio_write((uint8_t)(NRF_W_REGISTER | reg), &value, 1); }

static uint8_t get(uint8_t reg)
{
    uint8_t value = 0;
    (void)hal_radio_read((uint8_t)(NRF_R_REGISTER | reg), &value, 1);
    return value;
}

static void command(uint8_t code) { (void)hal_radio_write(code, NULL, 0); }

static uint8_t config_bits(const nrf24 *radio)
{
    return (uint8_t)(NRF_CONFIG_CRC_16 | (radio->role == NRF24_RECEIVER ? NRF_CONFIG_PRIM_RX : 0u));
}

/* Values of the registers besides CONFIG and the addresses, in the order in which `configure` writes them. */
#define SETTINGS 8u
static void wanted_settings(const nrf24_config *config, uint8_t values[SETTINGS])
{
    const uint8_t ack = config->auto_ack ? 1u : 0u;
    values[0] = ack;
    values[1] = 1u;
    values[2] = ADDRESS_WIDTH_5;
    values[3] = config->auto_ack ? config->retries : 0u; /* delay 0: 250 us */
    values[4] = config->channel;
    values[5] = NRF_RF_2_MBIT_0_DBM;
    values[6] = config->auto_ack ? NRF_FEATURE_DPL : 0u;
    values[7] = ack;
}

static bool address_holds(const nrf24 *radio, uint8_t reg)
{
    uint8_t found[NRF_ADDRESS_BYTES] = {0};
    (void)hal_radio_read((uint8_t)(NRF_R_REGISTER | reg), found, NRF_ADDRESS_BYTES);
    return memcmp(found, radio->config->address, NRF_ADDRESS_BYTES) == 0;
}

static bool configure(nrf24 *radio)
{
    static const uint8_t registers[SETTINGS] = {NRF_EN_AA, NRF_EN_RXADDR, NRF_SETUP_AW, NRF_SETUP_RETR,
                                                NRF_RF_CH, NRF_RF_SETUP,  NRF_FEATURE,  NRF_DYNPD};
    uint8_t values[SETTINGS];
    wanted_settings(radio->config, values);
    hal_radio_ce(false);
    put(NRF_CONFIG, config_bits(radio)); /* powered down while it is set up */
    for (uint8_t i = 0; i < SETTINGS; ++i) {
        put(registers[i], values[i]);
    }
    put(NRF_RX_PW_P0, NRF_PAYLOAD);
    (void)hal_radio_write(NRF_W_REGISTER | NRF_TX_ADDR, radio->config->address, NRF_ADDRESS_BYTES);
    (void)hal_radio_write(NRF_W_REGISTER | NRF_RX_ADDR_P0, radio->config->address, NRF_ADDRESS_BYTES); /* acks come here */
    command(NRF_FLUSH_TX);
    command(NRF_FLUSH_RX);
    put(NRF_STATUS, NRF_STATUS_FLAGS);
    bool good = get(NRF_CONFIG) == config_bits(radio) && get(NRF_RX_PW_P0) == NRF_PAYLOAD;
    for (uint8_t i = 0; i < SETTINGS && good; ++i) {
        good = get(registers[i]) == values[i];
    }
    return good && address_holds(radio, NRF_TX_ADDR) && address_holds(radio, NRF_RX_ADDR_P0);
}

void nrf24_init(nrf24 *radio, const nrf24_config *config, nrf24_role role)
{
    memset(radio, 0, sizeof *radio);
    radio->config = config;
    radio->role = role;
    radio->state = NRF24_POWER_UP;
}

void nrf24_power_up(nrf24 *radio)
{
    put(NRF_CONFIG, (uint8_t)(config_bits(radio) | NRF_CONFIG_PWR_UP));
    radio->state = NRF24_STARTING;
}

void nrf24_power_down(nrf24 *radio)
{
    hal_radio_ce(false);
    put(NRF_CONFIG, config_bits(radio));
    radio->queued = 0;
    radio->state = NRF24_DOWN;
}

uint32_t nrf24_setup_step(nrf24 *radio)
{
    switch (radio->state) {
    case NRF24_POWER_UP:
        hal_radio_ce(false);
        radio->state = NRF24_CONFIGURE;
        return POWER_ON_US;
    case NRF24_CONFIGURE:
        if (!configure(radio)) {
            return SETUP_RETRY_US;
        }
        nrf24_power_up(radio);
        return NRF24_START_US;
    case NRF24_STARTING:
        radio->stuck_in_row = 0;
        radio->state = NRF24_READY;
        hal_radio_ce(radio->role == NRF24_RECEIVER);
        return 0;
    case NRF24_READY:
    case NRF24_DOWN:
    default:
        return 0;
    }
}

static void start_over(nrf24 *radio)
{
    hal_radio_ce(false);
    radio->queued = 0;
    radio->state = NRF24_CONFIGURE;
    count_u8(&radio->restarts);
}

static void load(nrf24 *radio)
{
    (void)hal_radio_write(NRF_W_TX_PAYLOAD, radio->newest, NRF_PAYLOAD);
    hal_radio_ce(true); /* stays high until the frames are through: far longer than the 10 us it takes to start */
    if (radio->queued == 0u) {
        radio->sent_us = hal_micros();
    }
    ++radio->queued;
}

/* Clears the way for the next frame. A chip that keeps its payload all the same is set up anew, frames and all. */
static void give_up(nrf24 *radio)
{
    const bool one_behind = radio->queued > 1u;
    hal_radio_ce(false);
    count_u8(&radio->given_up);
    radio->queued = 0;
    command(NRF_FLUSH_TX);
    put(NRF_STATUS, NRF_STATUS_FLAGS); /* after the flush: clearing MAX_RT first would start the old frame again */
    const bool kept = (get(NRF_FIFO_STATUS) & NRF_FIFO_TX_EMPTY) == 0u;
    if (kept) {
        count_u8(&radio->stuck);
    }
    if (kept || radio->stuck_in_row >= STUCK_BEFORE_SETUP) {
        start_over(radio);
        if (one_behind) {
            count_u8(&radio->given_up);
        }
    } else if (one_behind) {
        load(radio);
    } else {
        /* ready for the next one */
    }
}

static void conclude_stuck(nrf24 *radio)
{
    radio->retransmissions = 0;
    count_u8(&radio->stuck);
    count_u8(&radio->stuck_in_row);
    give_up(radio);
}

static void conclude_sent(nrf24 *radio, uint8_t fifo)
{
    put(NRF_STATUS, NRF_STATUS_TX_DS);
    /* A frame that was left is looked at again after clearing, so that no end goes unseen. */
    if ((fifo & NRF_FIFO_TX_EMPTY) == 0u && (get(NRF_FIFO_STATUS) & NRF_FIFO_TX_EMPTY) == 0u) {
        radio->queued = 1;
        radio->sent_us = hal_micros();
        return;
    }
    hal_radio_ce(false);
    radio->queued = 0;
    radio->retransmissions = get(NRF_OBSERVE_TX) & 0x0Fu;
}

static inline void conclude(nrf24 *radio)
{
    uint8_t fifo = 0;
    const uint8_t status = hal_radio_read(NRF_R_REGISTER | NRF_FIFO_STATUS, &fifo, 1);
    if ((status & NRF_STATUS_MAX_RT) != 0u) {
        radio->stuck_in_row = 0;
        radio->retransmissions = get(NRF_OBSERVE_TX) & 0x0Fu;
        give_up(radio);
    } else if ((status & NRF_STATUS_TX_DS) != 0u) {
        radio->stuck_in_row = 0;
        conclude_sent(radio, fifo);
    } else { /* the line is low for no reason of ours */
        conclude_stuck(radio);
    }
}

void nrf24_send(nrf24 *radio, const uint8_t payload[NRF_PAYLOAD])
{
    if (radio->state != NRF24_READY || radio->queued >= MOST_QUEUED) {
        count_u8(&radio->given_up);
        return;
    }
    memcpy(radio->newest, payload, NRF_PAYLOAD);
    load(radio);
}

bool nrf24_busy(nrf24 *radio)
{
    if (radio->queued == 0u) {
        return false;
    }
    if (hal_radio_irq()) {
        conclude(radio);
    } else if ((uint32_t)(hal_micros() - radio->sent_us) > RADIO_TIMEOUT_US) {
        conclude_stuck(radio);
    } else {
        /* on its way */
    }
    return radio->queued > 0u;
}

/* Waits until no more than `most` frames are with the chip. */
static inline void wait_for(nrf24 *radio, uint8_t most)
{
    uint16_t polls = 0;
    while (nrf24_busy(radio) && radio->queued > most) {
        ++polls;
        if (polls >= MOST_POLLS) {
            conclude_stuck(radio);
        }
    }
}

void nrf24_finish(nrf24 *radio) { wait_for(radio, 0); }

void nrf24_make_room(nrf24 *radio) { wait_for(radio, MOST_QUEUED - 1u); }

nrf24_reception nrf24_receive(nrf24 *radio, uint8_t payload[NRF_PAYLOAD])
{
    if (radio->state != NRF24_READY || (get(NRF_FIFO_STATUS) & NRF_FIFO_RX_EMPTY) != 0u) {
        return NRF24_NOTHING;
    }
    uint8_t width = NRF_PAYLOAD;
    if (radio->config->auto_ack) {
        (void)hal_radio_read(NRF_R_RX_PL_WID, &width, 1);
    }
    if (width == 0u || width > NRF_PAYLOAD) { /* the specification's own remedy */
        command(NRF_FLUSH_RX);
    } else {
        (void)hal_radio_read(NRF_R_RX_PAYLOAD, payload, width);
    }
    put(NRF_STATUS, NRF_STATUS_RX_DR);
    if (width != NRF_PAYLOAD) {
        count_u8(&radio->bad_width);
        return NRF24_BAD;
    }
    return NRF24_PAYLOAD;
}

bool nrf24_verify(nrf24 *radio)
{
    if (radio->state != NRF24_READY || radio->queued > 0u) {
        return radio->queued > 0u;
    }
    const uint8_t ack = radio->config->auto_ack ? 1u : 0u;
    if (get(NRF_CONFIG) == (config_bits(radio) | NRF_CONFIG_PWR_UP) && get(NRF_EN_AA) == ack &&
        get(NRF_RF_CH) == radio->config->channel && get(NRF_RF_SETUP) == NRF_RF_2_MBIT_0_DBM &&
        address_holds(radio, NRF_TX_ADDR)) {
        return true;
    }
    start_over(radio);
    return false;
}
