#include "bno055.h"

#include <string.h>

#include "config.h"
#include "counters.h"

#define BOOT_US 650000u
#define TO_CONFIG_US 20000u /* 19 ms in the sheet */
#define FROM_CONFIG_US 20000u /* 7 ms in the sheet; the first sample takes longer */
#define STEP_US 1000u
#define PWR_NORMAL 0x00u

static bool put(bno055 *chip, uint8_t reg, uint8_t value) { return i2c_write_byte(chip->bus, BNO_ADDRESS, reg, value); }

static bool holds(bno055 *chip, uint8_t reg, uint8_t value)
{
    uint8_t found = 0;
    return i2c_read(chip->bus, BNO_ADDRESS, reg, &found, 1) && found == value;
}

static bool enter_config(bno055 *chip)
{
    /* PAGE_ID is the only register on both pages, so it comes first: a reset of ours alone leaves the chip on page 1. */
    return put(chip, BNO_REG_PAGE_ID, 0) && holds(chip, BNO_REG_CHIP_ID, BNO_CHIP_ID) &&
           put(chip, BNO_REG_OPR_MODE, BNO_MODE_CONFIG);
}

static bool set_units(bno055 *chip)
{
    return put(chip, BNO_REG_PWR_MODE, PWR_NORMAL) && put(chip, BNO_REG_UNIT_SEL, chip->config.unit_sel) &&
           holds(chip, BNO_REG_UNIT_SEL, chip->config.unit_sel);
}

static bool set_sensors(bno055 *chip)
{
    const uint8_t wanted[BNO_CONFIG_BYTES] = {chip->config.acc_config, chip->config.mag_config, chip->config.gyr_config_0,
                                              chip->config.gyr_config_1};
    uint8_t found[BNO_CONFIG_BYTES];
    if (!put(chip, BNO_REG_PAGE_ID, 1)) {
        return false;
    }
    bool good = true;
    for (uint8_t i = 0; i < BNO_CONFIG_BYTES && good; ++i) { /* one at a time: not every chip takes bursts on page 1 */
        good = put(chip, (uint8_t)(BNO_REG1_ACC_CONFIG + i), wanted[i]);
    }
    good = good && i2c_read(chip->bus, BNO_ADDRESS, BNO_REG1_ACC_CONFIG, found, BNO_CONFIG_BYTES) &&
           memcmp(wanted, found, BNO_CONFIG_BYTES) == 0;
    return put(chip, BNO_REG_PAGE_ID, 0) && good; /* page 0 again in any case */
}

void bno055_init(bno055 *chip, i2c_bus *bus, const bno055_config *config)
{
    memset(chip, 0, sizeof *chip);
    chip->bus = bus;
    chip->config = *config;
    chip->state = BNO_POWER_UP;
}

static uint32_t advance(bno055 *chip, bool done, bno055_state next, uint32_t wait_us)
{
    if (done) {
        chip->state = next;
        return wait_us;
    }
    count_u8(&chip->setup_failures);
    chip->state = BNO_IDENTIFY;
    if ((chip->setup_failures & 3u) == 0u) {
        (void)put(chip, BNO_REG_SYS_TRIGGER, BNO_TRIGGER_RESET);
        return BOOT_US;
    }
    return SETUP_RETRY_US;
}

uint32_t bno055_setup_step(bno055 *chip)
{
    switch (chip->state) {
    case BNO_POWER_UP:
        return advance(chip, true, BNO_IDENTIFY, BOOT_US);
    case BNO_IDENTIFY:
        return advance(chip, enter_config(chip), BNO_SET_UNITS, TO_CONFIG_US);
    case BNO_SET_UNITS:
        return advance(chip, set_units(chip), BNO_SET_SENSORS, STEP_US);
    case BNO_SET_SENSORS:
        return advance(chip, set_sensors(chip), BNO_SET_MODE, STEP_US);
    case BNO_SET_MODE:
        return advance(chip, put(chip, BNO_REG_OPR_MODE, chip->config.mode), BNO_CHECK_MODE, FROM_CONFIG_US);
    case BNO_CHECK_MODE: {
        const uint32_t wait = advance(chip, holds(chip, BNO_REG_OPR_MODE, chip->config.mode), BNO_READY, 0);
        if (chip->state == BNO_READY) {
            chip->failures = 0;
            chip->setup_failures = 0;
        }
        return wait;
    }
    case BNO_READY:
    default:
        return 0;
    }
}

uint8_t bno055_mode(const bno055 *chip) { return chip->state == BNO_READY ? chip->config.mode : BNO_MODE_CONFIG; }

static bool settle_read(bno055 *chip, bool good)
{
    if (good) {
        chip->failures = 0;
        return true;
    }
    count_u8(&chip->failures);
    if (chip->failures >= READ_FAILURES_BEFORE_SETUP) {
        chip->state = BNO_IDENTIFY;
    }
    return false;
}

bool bno055_read(bno055 *chip, uint8_t registers[BNO_NDOF_BURST])
{
    const bool amg = chip->config.mode == BNO_MODE_AMG;
    const uint8_t reg = amg ? BNO_REG_ACC_DATA : BNO_REG_EULER_DATA;
    const uint8_t length = amg ? BNO_AMG_BURST : BNO_NDOF_BURST;
    if (chip->state == BNO_READY && settle_read(chip, i2c_read(chip->bus, BNO_ADDRESS, reg, registers, length))) {
        return true;
    }
    memset(registers, 0, BNO_NDOF_BURST);
    return false;
}

bool bno055_read_gyro(bno055 *chip, uint8_t gyro[BNO_GYR_BYTES])
{
    return chip->state == BNO_READY && i2c_read(chip->bus, BNO_ADDRESS, BNO_REG_GYR_DATA, gyro, BNO_GYR_BYTES);
}

bool bno055_read_health(bno055 *chip)
{
    uint8_t found[2];
    if (chip->state != BNO_READY || !i2c_read(chip->bus, BNO_ADDRESS, BNO_REG_TEMP, found, sizeof found)) {
        return false;
    }
    chip->temperature = found[0];
    chip->calib_stat = found[1];
    return true;
}

bool bno055_verify(bno055 *chip)
{
    if (chip->state != BNO_READY) {
        return false;
    }
    uint8_t mode = 0;
    /* A refused transfer alone is no proof; a chip that answers with another mode, or page, is. */
    if (i2c_read(chip->bus, BNO_ADDRESS, BNO_REG_OPR_MODE, &mode, 1) && (mode & 0x0Fu) != chip->config.mode) {
        chip->state = BNO_IDENTIFY;
        return false;
    }
    return true;
}
