#include "fake_hal.h"

#include <string.h>

#include "bench.h"
#include "board.h"
#include "config.h"

fake_hal fake;

void fake_reset(void)
{
    memset(&fake, 0, sizeof fake);
    chips_power_on(&fake.registers, 0);
    fake.adc[HAL_ADC_LISY] = 512;
    fake.adc[HAL_ADC_BATTERY] = 605;
    air_init(&fake.air, 1);
    fake.receiver_reads = true;
    fake.in_receiver = true;
    nrf24 listener;
    nrf24_init(&listener, &radio_config, NRF24_RECEIVER);
    while (nrf24_setup_step(&listener) != 0) {
    }
    fake.in_receiver = false;
    fake.time_us = 0;
}

static hal_status fault(uint8_t address)
{
    ++fake.transfers;
    if (fake.fail_at > 0 && --fake.fail_at == 0) {
        return HAL_NACK;
    }
    return address == MPU_ADDRESS ? fake.fail_mpu : fake.fail_bno;
}

static void spend(uint64_t us) { fake.time_us += fake.frozen ? 0u : us; }

uint32_t hal_micros(void) { return fake.start_us + (uint32_t)fake.time_us; }

hal_status hal_i2c_read(uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, uint16_t deadline_us)
{
    const hal_status status = fault(address);
    if (status != HAL_OK) {
        fake.time_us += status == HAL_NACK ? 25u : deadline_us;
        return status;
    }
    if (!chips_answer(&fake.registers, address, fake.time_us * 1000u)) {
        return HAL_NACK;
    }
    sensor_image image;
    bench_image(&fake.registers, 1, fake.time_us * 1000u, &image);
    fake.time_us += 23u * (length + 3u);
    return chips_read(&fake.registers, address, reg, data, length, &image) ? HAL_OK : HAL_NACK;
}

hal_status hal_i2c_write(uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint16_t deadline_us)
{
    const hal_status status = fault(address);
    if (status != HAL_OK) {
        fake.time_us += status == HAL_NACK ? 25u : deadline_us;
        return status;
    }
    fake.time_us += 23u * (length + 2u);
    return chips_write(&fake.registers, address, reg, data, length, fake.time_us * 1000u) ? HAL_OK : HAL_NACK;
}

bool hal_i2c_drive(bool scl, bool sda)
{
    spend(5);
    if (scl && !fake.scl) {
        ++fake.scl_clocks;
        fake.sda_clocks -= fake.sda_clocks > 0 ? 1u : 0u;
    }
    fake.scl = scl;
    return sda && fake.sda_clocks == 0 && !fake.sda_short;
}

void hal_i2c_restart(void) { ++fake.recoveries; }

void hal_adc_start(void) {}

uint16_t hal_adc_sum(hal_adc_channel channel)
{
    const uint16_t conversions = channel == HAL_ADC_LISY ? LISY_CONVERSIONS : 1u;
    fake.time_us += 12u * conversions;
    return (uint16_t)(conversions * fake.adc[channel]);
}

static void advance_air(void)
{
    (void)air_advance(&fake.air, fake.time_us * 1000u);
    if (fake.receiver_reads) {
        fake.air.receiver.rx_count = 0;
    }
}

static void record(const uint8_t *payload)
{
    if (fake.sent > 0 && memcmp(fake.frames[(fake.sent - 1u) % FAKE_FRAMES], payload, FRAME_SIZE) == 0) {
        return; /* written once more after a flush */
    }
    fake.radio_overruns += fake.air.sender.tx_count > 1 ? 1u : 0u;
    memcpy(fake.frames[fake.sent % FAKE_FRAMES], payload, FRAME_SIZE);
    ++fake.sent;
}

static uint8_t transact(uint8_t command, const uint8_t *out, uint8_t *in, uint8_t length)
{
    spend(8u * (1u + length));
    if (fake.radio_dead || (command == NRF_FLUSH_TX && fake.ignores_flush)) {
        if (in != NULL) {
            memset(in, 0, length);
        }
        return 0;
    }
    if (fake.in_receiver) {
        return nrf_chip_spi(&fake.air.receiver, fake.time_us * 1000u, command, out, in, length);
    }
    if (command == NRF_W_TX_PAYLOAD && out != NULL) {
        record(out);
    }
    advance_air();
    const uint8_t status = nrf_chip_spi(&fake.air.sender, fake.time_us * 1000u, command, out, in, length);
    advance_air();
    return status;
}

uint8_t hal_radio_write(uint8_t command, const uint8_t *data, uint8_t length) { return transact(command, data, NULL, length); }

uint8_t hal_radio_read(uint8_t command, uint8_t *data, uint8_t length) { return transact(command, NULL, data, length); }

void hal_radio_ce(bool high)
{
    if (fake.in_receiver) {
        fake.air.receiver.ce = high;
    } else {
        fake.air.sender.ce = high;
        advance_air();
    }
}

bool hal_radio_irq(void)
{
    spend(2);
    advance_air();
    return fake.irq_low || nrf_chip_irq(fake.in_receiver ? &fake.air.receiver : &fake.air.sender);
}

uint8_t hal_serial_write(const uint8_t *data, uint8_t length)
{
    const uint8_t taken = length < fake.serial_room ? length : (uint8_t)fake.serial_room;
    for (uint8_t i = 0; i < taken && fake.serial_size < sizeof fake.serial; ++i) {
        fake.serial[fake.serial_size++] = data[i];
    }
    fake.serial_room -= taken;
    return taken;
}

void hal_watchdog_kick(void) { ++fake.kicks; }

reset_cause hal_reset_cause(void) { return RESET_BROWN_OUT; }
