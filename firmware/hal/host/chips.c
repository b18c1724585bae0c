#include "chips.h"

#include <string.h>

#include "bno055.h"
#include "config.h"
#include "mpu6050.h"

#define MPU_SLEEP 0x40u
#define BNO_BOOT_NS 400000000u /* power-on reset time of the sheet */
#define BNO_FUSION_FIRST BNO_REG_EULER_DATA
#define BNO_FUSION_LAST 0x33u
#define BNO_FIRST_FUSION_MODE 0x08u

static void reset_mpu(chips *c)
{
    memset(c->mpu, 0, sizeof c->mpu);
    c->mpu[MPU_REG_PWR_MGMT_1] = MPU_SLEEP;
    c->mpu[MPU_REG_WHO_AM_I] = MPU_WHO_AM_I;
}

static void reset_bno(chips *c, uint64_t now_ns)
{
    static const uint8_t PAGE_1_DEFAULTS[BNO_CONFIG_BYTES] = {0x0D, 0x0B, 0x38, 0x00};
    memset(c->bno, 0, sizeof c->bno);
    c->bno[0][BNO_REG_CHIP_ID] = BNO_CHIP_ID;
    c->bno[0][BNO_REG_UNIT_SEL] = 0x80;
    memcpy(&c->bno[1][BNO_REG1_ACC_CONFIG], PAGE_1_DEFAULTS, sizeof PAGE_1_DEFAULTS);
    c->bno_answers_from_ns = now_ns + BNO_BOOT_NS;
}

void chips_power_on(chips *c, uint64_t now_ns)
{
    reset_mpu(c);
    reset_bno(c, now_ns);
}

bool chips_answer(const chips *c, uint8_t address, uint64_t now_ns)
{
    return address == MPU_ADDRESS || (address == BNO_ADDRESS && now_ns >= c->bno_answers_from_ns);
}

static uint8_t mpu_register(const chips *c, uint8_t reg, const sensor_image *image)
{
    const bool awake = (c->mpu[MPU_REG_PWR_MGMT_1] & MPU_SLEEP) == 0;
    if (reg >= MPU_REG_ACCEL_XOUT_H && reg < MPU_REG_ACCEL_XOUT_H + IMAGE_MPU_BYTES) {
        return awake ? image->mpu[reg - MPU_REG_ACCEL_XOUT_H] : 0;
    }
    return c->mpu[reg];
}

static uint8_t bno_register(const chips *c, uint8_t reg, const sensor_image *image)
{
    const unsigned page = c->bno[0][BNO_REG_PAGE_ID];
    const uint8_t mode = c->bno[0][BNO_REG_OPR_MODE];
    if (reg == BNO_REG_PAGE_ID) {
        return (uint8_t)page;
    }
    if (page == 0 && reg >= IMAGE_BNO_FIRST && reg < IMAGE_BNO_FIRST + IMAGE_BNO_BYTES) {
        const bool fusion = reg >= BNO_FUSION_FIRST && reg <= BNO_FUSION_LAST;
        const bool runs = mode != BNO_MODE_CONFIG && (!fusion || mode >= BNO_FIRST_FUSION_MODE);
        return runs ? image->bno[reg - IMAGE_BNO_FIRST] : 0;
    }
    return c->bno[page][reg];
}

bool chips_read(const chips *c, uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, const sensor_image *image)
{
    for (uint8_t i = 0; i < length; ++i) {
        const uint8_t at = (uint8_t)((reg + i) % CHIP_REGISTERS);
        data[i] = address == MPU_ADDRESS ? mpu_register(c, at, image) : bno_register(c, at, image);
    }
    return address == MPU_ADDRESS || address == BNO_ADDRESS;
}

static void write_mpu(chips *c, uint8_t reg, uint8_t value)
{
    if (reg == MPU_REG_PWR_MGMT_1 && (value & MPU_PWR_RESET) != 0) {
        reset_mpu(c);
    } else if (reg != MPU_REG_WHO_AM_I) {
        c->mpu[reg] = value;
    }
}

static void write_bno(chips *c, uint8_t reg, uint8_t value, uint64_t now_ns)
{
    const unsigned page = c->bno[0][BNO_REG_PAGE_ID];
    if (reg == BNO_REG_PAGE_ID) {
        c->bno[0][BNO_REG_PAGE_ID] = value & 1u;
    } else if (page == 1) {
        if (c->bno[0][BNO_REG_OPR_MODE] == BNO_MODE_CONFIG) { /* the chip ignores it in any other mode */
            c->bno[1][reg] = value;
        }
    } else if (reg == BNO_REG_SYS_TRIGGER && (value & BNO_TRIGGER_RESET) != 0) {
        reset_bno(c, now_ns);
    } else if (reg >= IMAGE_BNO_FIRST + IMAGE_BNO_BYTES) {
        c->bno[0][reg] = value;
    }
}

bool chips_write(chips *c, uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint64_t now_ns)
{
    if (!chips_answer(c, address, now_ns)) {
        return false;
    }
    for (uint8_t i = 0; i < length; ++i) {
        const uint8_t at = (uint8_t)((reg + i) % CHIP_REGISTERS);
        if (address == MPU_ADDRESS) {
            write_mpu(c, at, data[i]);
        } else {
            write_bno(c, at, data[i], now_ns);
        }
    }
    return true;
}
