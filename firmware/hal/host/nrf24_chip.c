#include "nrf24_chip.h"

#include <string.h>

#define POWER_UP_NS 1500000u
#define REGISTER_MASK 0x1Fu

void nrf_chip_reset(nrf_chip *chip)
{
    static const uint8_t DEFAULTS[NRF_REGISTERS] = {
        [NRF_CONFIG] = 0x08,  [NRF_EN_AA] = 0x3F,    [NRF_EN_RXADDR] = 0x03, [NRF_SETUP_AW] = 0x03, [NRF_SETUP_RETR] = 0x03,
        [NRF_RF_CH] = 0x02,   [NRF_RF_SETUP] = 0x0E, [NRF_STATUS] = 0,       [NRF_RX_ADDR_P0] = 0xE7, [NRF_TX_ADDR] = 0xE7};
    memset(chip, 0, sizeof *chip);
    memcpy(chip->registers, DEFAULTS, sizeof DEFAULTS);
    memset(chip->rx_address, 0xE7, NRF_ADDRESS_BYTES);
    memset(chip->tx_address, 0xE7, NRF_ADDRESS_BYTES);
}

static uint8_t status_of(const nrf_chip *chip)
{
    const uint8_t pipe = chip->rx_count > 0 ? 0u : 0x0Eu;
    return (uint8_t)((chip->registers[NRF_STATUS] & NRF_STATUS_FLAGS) | pipe |
                     (chip->tx_count == NRF_FIFO_DEPTH ? NRF_STATUS_TX_FULL : 0u));
}

static uint8_t fifo_status(const nrf_chip *chip)
{
    return (uint8_t)((chip->rx_count == 0 ? NRF_FIFO_RX_EMPTY : 0u) | (chip->rx_count == NRF_FIFO_DEPTH ? NRF_FIFO_RX_FULL : 0u) |
                     (chip->tx_count == 0 ? NRF_FIFO_TX_EMPTY : 0u) | (chip->tx_count == NRF_FIFO_DEPTH ? NRF_FIFO_TX_FULL : 0u));
}

static uint8_t *address_of(nrf_chip *chip, uint8_t reg)
{
    return reg == NRF_RX_ADDR_P0 ? chip->rx_address : reg == NRF_TX_ADDR ? chip->tx_address : NULL;
}

static void write_register(nrf_chip *chip, uint64_t now_ns, uint8_t reg, const uint8_t *data, uint8_t length)
{
    uint8_t *address = address_of(chip, reg);
    if (address != NULL) {
        memcpy(address, data, length < NRF_ADDRESS_BYTES ? length : NRF_ADDRESS_BYTES);
    } else if (reg == NRF_STATUS) {
        chip->registers[NRF_STATUS] &= (uint8_t)~(data[0] & NRF_STATUS_FLAGS); /* write 1 clears */
    } else if (reg < NRF_REGISTERS && reg != NRF_OBSERVE_TX && reg != NRF_FIFO_STATUS && length > 0) {
        if (reg == NRF_CONFIG && (data[0] & (uint8_t)~chip->registers[NRF_CONFIG] & NRF_CONFIG_PWR_UP) != 0) {
            chip->ready_ns = now_ns + POWER_UP_NS;
        }
        chip->registers[reg] = data[0];
    }
}

static void read_register(nrf_chip *chip, uint8_t reg, uint8_t *data, uint8_t length)
{
    const uint8_t *address = address_of(chip, reg);
    memset(data, 0, length);
    if (address != NULL) {
        memcpy(data, address, length < NRF_ADDRESS_BYTES ? length : NRF_ADDRESS_BYTES);
    } else if (length > 0) {
        data[0] = reg == NRF_STATUS        ? status_of(chip)
                  : reg == NRF_FIFO_STATUS ? fifo_status(chip)
                  : reg < NRF_REGISTERS    ? chip->registers[reg]
                                           : 0;
    }
}

static void push_tx(nrf_chip *chip, const uint8_t *data, uint8_t length)
{
    if (chip->tx_count < NRF_FIFO_DEPTH && length <= NRF_PAYLOAD) {
        memcpy(chip->tx[chip->tx_count].bytes, data, length);
        chip->tx[chip->tx_count].size = length;
        ++chip->tx_count;
    }
}

void nrf_chip_pop_tx(nrf_chip *chip)
{
    if (chip->tx_count > 0) {
        --chip->tx_count;
        memmove(&chip->tx[0], &chip->tx[1], chip->tx_count * sizeof chip->tx[0]);
    }
}

bool nrf_chip_push_rx(nrf_chip *chip, const nrf_payload *payload)
{
    if (chip->rx_count == NRF_FIFO_DEPTH) {
        return false;
    }
    chip->rx[chip->rx_count++] = *payload;
    chip->registers[NRF_STATUS] |= NRF_STATUS_RX_DR;
    return true;
}

static void pop_rx(nrf_chip *chip, uint8_t *data, uint8_t length)
{
    memset(data, 0, length);
    if (chip->rx_count > 0) {
        memcpy(data, chip->rx[0].bytes, length < NRF_PAYLOAD ? length : NRF_PAYLOAD);
        --chip->rx_count;
        memmove(&chip->rx[0], &chip->rx[1], chip->rx_count * sizeof chip->rx[0]);
    }
}

uint8_t nrf_chip_spi(nrf_chip *chip, uint64_t now_ns, uint8_t command, const uint8_t *out, uint8_t *in, uint8_t length)
{
    const uint8_t status = status_of(chip);
    const uint8_t reg = command & REGISTER_MASK;
    if (command == NRF_W_TX_PAYLOAD && out != NULL) {
        push_tx(chip, out, length);
    } else if (command == NRF_R_RX_PAYLOAD && in != NULL) {
        pop_rx(chip, in, length);
    } else if (command == NRF_R_RX_PL_WID && in != NULL) {
        in[0] = chip->rx_count > 0 ? chip->rx[0].size : 0;
    } else if (command == NRF_FLUSH_TX) {
        chip->tx_count = 0;
        chip->in_flight = false;
    } else if (command == NRF_FLUSH_RX) {
        chip->rx_count = 0;
    } else if ((command & 0xE0u) == NRF_W_REGISTER && out != NULL) {
        write_register(chip, now_ns, reg, out, length);
    } else if ((command & 0xE0u) == NRF_R_REGISTER && in != NULL) {
        read_register(chip, reg, in, length);
    }
    return status;
}

bool nrf_chip_irq(const nrf_chip *chip)
{
    /* MASK bits of CONFIG stand where the flags stand */
    return (chip->registers[NRF_STATUS] & (uint8_t)~chip->registers[NRF_CONFIG] & NRF_STATUS_FLAGS) != 0;
}

bool nrf_chip_is_up(const nrf_chip *chip, uint64_t now_ns)
{
    return (chip->registers[NRF_CONFIG] & NRF_CONFIG_PWR_UP) != 0 && now_ns >= chip->ready_ns;
}
