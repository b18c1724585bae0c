/* The rates table: a row of periods, one of phases, one of costs, all in us, columns in the order of the jobs in board.h:
 * MPU, BNO send, BNO read, BNO look, STATUS, BNO health, verify, radio verify, and the set-ups of MPU, BNO and radio.
 * Costs are the emulator's longest runs at 8 MIPS (README.md), but for the BNO's frame: it takes up to 1.0 ms, and starts all the
 * same where 0.75 ms are left, or it would never fit between two slots of the fast profile. */
#include "board.h"
#include "config.h"

#define BNO_CONFIG                                                                                                     \
    {                                                                                                                  \
        BNO_MODE_AMG, BNO_ACC_CONFIG, BNO_MAG_CONFIG, BNO_GYR_CONFIG_0, BNO_GYR_CONFIG_1, BNO_UNIT_SEL                 \
    }

#define RATES(mpu_period_us, bno_phase_us)                                                                             \
    {                                                                                                                  \
        {(mpu_period_us), 0u, 10000u, 0u, 1000000u, 100000u, 1000000u, 1000000u, 0u, 0u, 0u},                          \
        {0u, 0u, (bno_phase_us), 0u, 50000u, 3000u, 53000u, 58000u, 0u, 0u, 0u},                                       \
        {1240u, 690u, 690u, 690u, 920u, 480u, 930u, 900u, 900u, 1500u, 1430u}                                          \
    }

const nrf24_config radio_config = {RADIO_CHANNEL, RADIO_ADDRESS, RADIO_RETRIES, RADIO_AUTO_ACK};

const board_profile board_profile_default = {
    RATES(5000u, 2500u), {MPU_DLPF_CFG, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV}, BNO_CONFIG};

const board_profile board_profile_fast = {
    RATES(2000u, 1300u), {MPU_DLPF_CFG_FAST, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV_FAST}, BNO_CONFIG};
