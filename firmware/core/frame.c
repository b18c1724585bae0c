#include "frame.h"

#include <string.h>

#include "crc16.h"

/* Offsets inside the body, from the table in frame.h. */
enum {
    MPU_LISY = FRAME_BODY + 14u,
    MPU_BATTERY = FRAME_BODY + 16u,
    MPU_GIVEN_UP = FRAME_BODY + 18u,
    MPU_I2C_ERRORS = FRAME_BODY + 19u,
    MPU_RETRANSMISSIONS = FRAME_BODY + 20u,
    MPU_ZERO = FRAME_BODY + 21u,
    AMG_CALIB = FRAME_BODY + 18u,
    AMG_AGE = FRAME_BODY + 20u,
    NDOF_CALIB = FRAME_BODY + 20u,
    STATUS_MPU_PERIOD = FRAME_BODY + 12u,
    STATUS_BNO_PERIOD = FRAME_BODY + 14u,
    STATUS_UPTIME = FRAME_BODY + 16u,
    STATUS_ZERO = FRAME_BODY + 20u
};

static inline void put_u16(uint8_t *at, uint16_t value)
{
    at[0] = (uint8_t)(value & 0xFFu);
    at[1] = (uint8_t)(value >> 8);
}

static inline void put_u32(uint8_t *at, uint32_t value)
{
    put_u16(at, (uint16_t)(value & 0xFFFFu));
    put_u16(at + 2, (uint16_t)(value >> 16));
}

void frame_put_mpu(uint8_t frame[FRAME_SIZE], const frame_mpu *body)
{
    memcpy(&frame[FRAME_BODY], body->registers, MPU_BURST);
    put_u16(&frame[MPU_LISY], body->lisy_sum);
    put_u16(&frame[MPU_BATTERY], body->battery_mv);
    frame[MPU_GIVEN_UP] = body->radio_given_up;
    frame[MPU_I2C_ERRORS] = body->i2c_errors;
    frame[MPU_RETRANSMISSIONS] = body->retransmissions;
    frame[MPU_ZERO] = 0;
}

void frame_put_bno_amg(uint8_t frame[FRAME_SIZE], const frame_bno *body)
{
    memcpy(&frame[FRAME_BODY], body->registers, BNO_AMG_BURST);
    frame[AMG_CALIB] = body->calib_stat;
    frame[AMG_CALIB + 1] = body->temperature;
    put_u16(&frame[AMG_AGE], body->age_us);
}

void frame_put_bno_ndof(uint8_t frame[FRAME_SIZE], const frame_bno *body)
{
    memcpy(&frame[FRAME_BODY], body->registers, BNO_NDOF_BURST);
    frame[NDOF_CALIB] = body->calib_stat;
    frame[NDOF_CALIB + 1] = body->temperature;
}

void frame_put_status(uint8_t frame[FRAME_SIZE], const frame_status *body)
{
    uint8_t *at = &frame[FRAME_BODY];
    at[0] = body->major;
    at[1] = body->minor;
    at[2] = body->mpu_dlpf_cfg;
    at[3] = (uint8_t)((unsigned)(body->mpu_fs_sel << 4) | body->mpu_afs_sel);
    at[4] = body->mpu_smplrt_div;
    at[5] = body->bno_opr_mode;
    at[6] = body->bno_acc_config;
    at[7] = body->bno_gyr_config_0;
    at[8] = body->bno_gyr_config_1;
    at[9] = body->bno_mag_config;
    at[10] = body->reset_cause;
    at[11] = body->bno_unit_sel;
    put_u16(&frame[STATUS_MPU_PERIOD], body->mpu_period_us);
    put_u16(&frame[STATUS_BNO_PERIOD], body->bno_period_us);
    put_u32(&frame[STATUS_UPTIME], body->uptime_s);
    put_u16(&frame[STATUS_ZERO], 0);
}

void frame_close(uint8_t frame[FRAME_SIZE], const frame_header *header)
{
    frame[0] = (uint8_t)((FRAME_VERSION << 5) | header->type);
    frame[1] = header->flags;
    put_u16(&frame[2], header->sequence);
    put_u32(&frame[4], header->time_us);
    put_u16(&frame[FRAME_CRC], crc16(frame, FRAME_CRC));
}

bool frame_is_sound(const uint8_t frame[FRAME_SIZE])
{
    const uint16_t crc = (uint16_t)(frame[FRAME_CRC] | ((unsigned)frame[FRAME_CRC + 1u] << 8));
    return (frame[0] >> 5) == FRAME_VERSION && crc == crc16(frame, FRAME_CRC);
}
