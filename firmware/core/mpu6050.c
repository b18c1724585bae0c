#include "mpu6050.h"

#include <string.h>

#include "config.h"
#include "counters.h"

#define POWER_UP_US 100000u /* after reset, register map 4.28 */
#define WAKE_US 10000u
#define SETTLE_US 50000u /* gyro start-up 30 ms typical */

#define CONFIG_BYTES 4u /* SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG follow one another */

static void wanted_registers(const mpu6050_config *config, uint8_t registers[CONFIG_BYTES])
{
    registers[0] = config->smplrt_div;
    registers[1] = config->dlpf_cfg;
    registers[2] = (uint8_t)((unsigned)config->fs_sel << 3);
    registers[3] = (uint8_t)((unsigned)config->afs_sel << 3);
}

static bool config_matches(mpu6050 *chip)
{
    uint8_t wanted[CONFIG_BYTES];
    uint8_t found[CONFIG_BYTES];
    wanted_registers(&chip->config, wanted);
    return i2c_read(chip->bus, MPU_ADDRESS, MPU_REG_SMPLRT_DIV, found, CONFIG_BYTES) &&
           memcmp(wanted, found, CONFIG_BYTES) == 0;
}

static bool write_config(mpu6050 *chip)
{
    uint8_t wanted[CONFIG_BYTES];
    wanted_registers(&chip->config, wanted);
    return i2c_write(chip->bus, MPU_ADDRESS, MPU_REG_SMPLRT_DIV, wanted, CONFIG_BYTES) && config_matches(chip);
}

static bool write_power(mpu6050 *chip, uint8_t value)
{
    return i2c_write_byte(chip->bus, MPU_ADDRESS, MPU_REG_PWR_MGMT_1, value);
}

static bool identify(mpu6050 *chip)
{
    uint8_t id = 0;
    return i2c_read(chip->bus, MPU_ADDRESS, MPU_REG_WHO_AM_I, &id, 1) && id == MPU_WHO_AM_I;
}

void mpu6050_init(mpu6050 *chip, i2c_bus *bus, const mpu6050_config *config)
{
    chip->bus = bus;
    chip->config = *config;
    chip->state = MPU_POWER_UP;
    chip->failures = 0;
}

static uint32_t advance(mpu6050 *chip, bool done, mpu6050_state next, uint32_t wait_us)
{
    if (done) {
        chip->state = next;
        return wait_us;
    }
    chip->state = MPU_POWER_UP;
    return SETUP_RETRY_US;
}

uint32_t mpu6050_setup_step(mpu6050 *chip)
{
    switch (chip->state) {
    case MPU_POWER_UP:
        return advance(chip, identify(chip) && write_power(chip, MPU_PWR_RESET), MPU_RESETTING, POWER_UP_US);
    case MPU_RESETTING:
        return advance(chip, write_power(chip, MPU_PWR_CLOCK_GYRO), MPU_WAKING, WAKE_US);
    case MPU_WAKING:
        return advance(chip, write_config(chip), MPU_SETTLING, SETTLE_US);
    case MPU_SETTLING:
        chip->failures = 0;
        return advance(chip, true, MPU_READY, 0);
    case MPU_READY:
    default:
        return 0;
    }
}

bool mpu6050_read(mpu6050 *chip, uint8_t registers[MPU_BURST])
{
    if (chip->state == MPU_READY) {
        if (i2c_read(chip->bus, MPU_ADDRESS, MPU_REG_ACCEL_XOUT_H, registers, MPU_BURST)) {
            chip->failures = 0;
            return true;
        }
        count_u8(&chip->failures);
        if (chip->failures >= READ_FAILURES_BEFORE_SETUP) {
            chip->state = MPU_POWER_UP;
        }
    }
    memset(registers, 0, MPU_BURST);
    return false;
}

bool mpu6050_verify(mpu6050 *chip)
{
    if (chip->state != MPU_READY) {
        return false;
    }
    uint8_t power = 0;
    if (config_matches(chip) && i2c_read(chip->bus, MPU_ADDRESS, MPU_REG_PWR_MGMT_1, &power, 1) &&
        power == MPU_PWR_CLOCK_GYRO) {
        return true;
    }
    chip->state = MPU_POWER_UP;
    return false;
}
