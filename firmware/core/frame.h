/* The radio's 32-byte frame. Little-endian unless said otherwise.
 *
 *  offset  size  field
 *       0     1  version << 5 | type
 *       1     1  flags (FRAME_FLAG_...)
 *       2     2  sequence: one counter over all types, one up per frame handed to the radio
 *       4     4  board time in us at the start of the sensor's read (wraps)
 *       8    22  body
 *      30     2  CRC-16/CCITT-FALSE over bytes 0 to 29
 *
 *  body of type 1, MPU          body of type 2, BNO AMG             body of type 4, BNO NDOF
 *    8 14 registers 0x3B..0x48    8 18 registers 0x08..0x19           8 20 registers 0x1A..0x2D
 *         (big-endian int16)           (int16)                             (int16)
 *   22  2 LISY300, sum of 16     26  1 CALIB_STAT                    28  1 CALIB_STAT
 *   24  2 battery, mV            27  1 temperature, degC, signed     29  1 temperature
 *   26  1 radio frames given up  28  2 age of the gyro sample, us
 *   27  1 I2C errors
 *   28  1 retransmissions of the last frame
 *   29  1 zero
 *
 *  body of type 3, STATUS: every field in the order of `frame_status` below; 8 to 19 single bytes (MPU full scales share
 *  byte 11: FS_SEL << 4 | AFS_SEL), 20 u16 MPU period, 22 u16 BNO period, 24 u32 uptime, 28 u16 zero
 */
#ifndef GSENSE_FRAME_H
#define GSENSE_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#define FRAME_SIZE 32u
#define FRAME_VERSION 1u

#define FRAME_BODY 8u
#define FRAME_CRC 30u

#define FRAME_MPU 1u
#define FRAME_BNO_AMG 2u
#define FRAME_STATUS 3u
#define FRAME_BNO_NDOF 4u

#define FRAME_FLAG_READ_FAILED 0x01u /* body not valid */
#define FRAME_FLAG_STARTED 0x02u     /* the board started less than 1 s ago */
#define FRAME_FLAG_BATTERY_LOW 0x04u

#define MPU_BURST 14u
#define BNO_AMG_BURST 18u
#define BNO_NDOF_BURST 20u

typedef struct {
    uint8_t type;
    uint8_t flags;
    uint16_t sequence;
    uint32_t time_us;
} frame_header;

typedef struct {
    const uint8_t *registers; /* MPU_BURST bytes */
    uint16_t lisy_sum;
    uint16_t battery_mv;
    uint8_t radio_given_up;
    uint8_t i2c_errors;
    uint8_t retransmissions;
} frame_mpu;

typedef struct {
    const uint8_t *registers; /* BNO_AMG_BURST or BNO_NDOF_BURST bytes */
    uint8_t calib_stat;
    uint8_t temperature; /* two's complement, as read */
    uint16_t age_us;     /* AMG only */
} frame_bno;

typedef struct {
    uint8_t major;
    uint8_t minor;
    uint8_t mpu_dlpf_cfg;
    uint8_t mpu_fs_sel;
    uint8_t mpu_afs_sel;
    uint8_t mpu_smplrt_div;
    uint8_t bno_opr_mode;
    uint8_t bno_acc_config;
    uint8_t bno_gyr_config_0;
    uint8_t bno_gyr_config_1;
    uint8_t bno_mag_config;
    uint8_t reset_cause;
    uint8_t bno_unit_sel;
    uint16_t mpu_period_us;
    uint16_t bno_period_us;
    uint32_t uptime_s;
} frame_status;

/* Body first, header last: the sequence number and the flags are known only when the frame is handed over.
 * `frame_close` writes the header and the CRC. */
void frame_put_mpu(uint8_t frame[FRAME_SIZE], const frame_mpu *body);
void frame_put_bno_amg(uint8_t frame[FRAME_SIZE], const frame_bno *body);
void frame_put_bno_ndof(uint8_t frame[FRAME_SIZE], const frame_bno *body);
void frame_put_status(uint8_t frame[FRAME_SIZE], const frame_status *body);
void frame_close(uint8_t frame[FRAME_SIZE], const frame_header *header);

/* True when version and CRC are right (for the receiver and for tests). */
bool frame_is_sound(const uint8_t frame[FRAME_SIZE]);

#endif
