#include "bench.h"

#include <string.h>

#include "bno055.h"
#include "mpu6050.h"

#define NS_PER_MS 1000000u
#define BNO_GYRO_NS 10030000u /* the BNO055's own clock: 0.3 % slow */
#define BNO_MAG_NS 100000000u
#define BATTERY_MV 3900u
#define LISY_REST 512 /* 1.65 V of 3.3 V */

enum { CHANNEL_MPU = 0, CHANNEL_BNO_ACC = 16, CHANNEL_BNO_MAG = 32, CHANNEL_BNO_GYR = 48, CHANNEL_LISY = 64 };

/* Roughly normal noise, standard deviation `sigma_milli` / 1000, from a linear congruential generator that starts anew at
 * every sample: any instant can be asked for in any order. */
static int32_t noise(uint32_t seed, uint64_t sample, unsigned channel, int32_t sigma_milli)
{
    uint64_t state = (seed + 1u) * 0x9E3779B97F4A7C15u ^ (sample * 256u + channel) * 0xD1342543DE82EF95u;
    int32_t sum = 0;
    for (int i = 0; i < 8; ++i) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        sum += i < 4 ? 0 : (int32_t)(state >> 56); /* the first steps only mix */
    }
    const int32_t scaled = (sum - 510) * sigma_milli / 148; /* four bytes: mean 510, sigma 148 */
    return (scaled + (scaled < 0 ? -500 : 500)) / 1000;
}

static void put_big_endian(uint8_t *at, int32_t value)
{
    at[0] = (uint8_t)((uint32_t)value >> 8);
    at[1] = (uint8_t)value;
}

static void put_little_endian(uint8_t *at, int32_t value)
{
    at[0] = (uint8_t)value;
    at[1] = (uint8_t)((uint32_t)value >> 8);
}

static void fill_mpu(const chips *c, uint32_t seed, uint64_t time_ns, uint8_t data[IMAGE_MPU_BYTES])
{
    static const int32_t OFFSET_MDPS[3] = {620, -410, 180};
    static const int32_t LSB_PER_DPS_10[4] = {1310, 655, 328, 164};
    const unsigned fs = (c->mpu[MPU_REG_GYRO_CONFIG] >> 3) & 3u;
    const unsigned afs = (c->mpu[MPU_REG_ACCEL_CONFIG] >> 3) & 3u;
    const uint64_t period = (uint64_t)NS_PER_MS * (1u + c->mpu[MPU_REG_SMPLRT_DIV]);
    const uint64_t sample = time_ns / period;
    for (unsigned i = 0; i < 3; ++i) {
        const int32_t gravity = i == 2 ? 16384 >> afs : 0;
        const int32_t offset = OFFSET_MDPS[i] * LSB_PER_DPS_10[fs] / 10000;
        put_big_endian(data + 2 * i, gravity + noise(seed, sample, CHANNEL_MPU + i, 54000 >> afs)); /* 3.3 mg */
        put_big_endian(data + 8 + 2 * i, offset + noise(seed, sample, CHANNEL_MPU + 4 + i, LSB_PER_DPS_10[fs] * 5)); /* 0.05 deg/s */
    }
    put_big_endian(data + 6, (25 * 100 - 3653) * 340 / 100 + noise(seed, sample, CHANNEL_MPU + 3, 8000));
}

static void fill_bno(const chips *c, uint32_t seed, uint64_t time_ns, sensor_image *image)
{
    static const int32_t GYRO_OFFSET[3] = {-6, 9, 3}; /* 16 LSB per deg/s */
    static const int32_t FIELD[3] = {20 * 16, 0, -44 * 16};
    const uint64_t sample = time_ns / BNO_GYRO_NS;
    uint8_t *data = image->bno; /* offsets are register - 0x08 */
    for (unsigned i = 0; i < 3; ++i) {
        put_little_endian(data + 2 * i, (i == 2 ? 981 : 0) + noise(seed, sample, CHANNEL_BNO_ACC + i, 1500));
        put_little_endian(data + 6 + 2 * i, FIELD[i] + noise(seed, time_ns / BNO_MAG_NS, CHANNEL_BNO_MAG + i, 5000));
        put_little_endian(data + 12 + 2 * i, GYRO_OFFSET[i] + noise(seed, sample, CHANNEL_BNO_GYR + i, 1600));
        put_little_endian(data + 0x28 - IMAGE_BNO_FIRST + 2 * i, noise(seed, sample, CHANNEL_BNO_ACC + 4 + i, 1500));
    }
    put_little_endian(data + 0x20 - IMAGE_BNO_FIRST, 16384); /* quaternion w = 1 */
    put_little_endian(data + 0x32 - IMAGE_BNO_FIRST, 981);   /* gravity z */
    data[BNO_REG_TEMP - IMAGE_BNO_FIRST] = 25;
    data[BNO_REG_CALIB_STAT - IMAGE_BNO_FIRST] = c->bno[0][BNO_REG_OPR_MODE] == BNO_MODE_NDOF ? 0xFF : 0;
    image->bno_time_ns = sample * BNO_GYRO_NS;
}

void bench_image(const chips *c, uint32_t seed, uint64_t time_ns, sensor_image *image)
{
    memset(image, 0, sizeof *image);
    image->time_ns = time_ns;
    fill_mpu(c, seed, time_ns, image->mpu);
    fill_bno(c, seed, time_ns, image);
    for (unsigned i = 0; i < IMAGE_LISY; ++i) {
        image->lisy[i] = (uint16_t)(LISY_REST + noise(seed, time_ns / (5u * NS_PER_MS), CHANNEL_LISY + i, 800));
    }
    image->battery_mv = BATTERY_MV;
}
