#include "fake_hal.h"

#include <string.h>

#include "bench.h"
#include "config.h"

fake_hal fake;

void fake_reset(void)
{
    memset(&fake, 0, sizeof fake);
    chips_power_on(&fake.registers, 0);
    fake.adc[HAL_ADC_LISY] = 512;
    fake.adc[HAL_ADC_BATTERY] = 605;
}

static hal_status fault(uint8_t address)
{
    ++fake.transfers;
    if (fake.fail_at > 0 && --fake.fail_at == 0) {
        return HAL_NACK;
    }
    return address == MPU_ADDRESS ? fake.fail_mpu : fake.fail_bno;
}

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

void hal_i2c_recover(void) { ++fake.recoveries; }

uint16_t hal_adc_read(hal_adc_channel channel)
{
    fake.time_us += 12;
    return fake.adc[channel];
}

void hal_radio_send(const uint8_t payload[RADIO_PAYLOAD])
{
    fake.radio_overruns += fake.radio_busy ? 1u : 0u;
    fake.radio_busy = true;
    memcpy(fake.frames[fake.sent % FAKE_FRAMES], payload, FRAME_SIZE);
    ++fake.sent;
    fake.time_us += 267;
}

hal_radio_result hal_radio_finish(void)
{
    fake.radio_busy = false;
    return fake.radio;
}

void hal_watchdog_kick(void) { ++fake.kicks; }

reset_cause hal_reset_cause(void) { return RESET_BROWN_OUT; }
