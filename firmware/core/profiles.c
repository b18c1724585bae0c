/* The rates table: a row of periods, one of phases, one of costs, all in us. Costs are the emulator's longest runs at 8 MIPS
 * (README.md), but for the BNO's jobs, which take 0.7 to 1.0 ms: reading and sending start where 0.56 ms are left, looking where
 * 0.69 ms are, or they would not find room between the slots of the fast profile. Its MPU slots then start up to 0.4 ms late. */
#include "board.h"
#include "config.h"

#define BNO_CONFIG                                                                                                     \
    {                                                                                                                  \
        BNO_MODE_AMG, BNO_ACC_CONFIG, BNO_MAG_CONFIG, BNO_GYR_CONFIG_0, BNO_GYR_CONFIG_1, BNO_UNIT_SEL                 \
    }

#define RATES(mpu_period_us, bno_phase_us)                                                                             \
    {                                                                                                                  \
        {[JOB_MPU] = (mpu_period_us), [JOB_BNO_READ] = 10000u, [JOB_STATUS] = 1000000u, [JOB_BNO_HEALTH] = 100000u,    \
         [JOB_VERIFY] = 1000000u, [JOB_RADIO_VERIFY] = 1000000u},                                                      \
        {[JOB_BNO_READ] = (bno_phase_us), [JOB_STATUS] = 50000u, [JOB_BNO_HEALTH] = 3000u, [JOB_VERIFY] = 53000u,      \
         [JOB_RADIO_VERIFY] = 58000u},                                                                                 \
        {[JOB_MPU] = 1250u, [JOB_BNO_SEND] = 560u, [JOB_BNO_READ] = 560u, [JOB_BNO_LOOK] = 690u, [JOB_STATUS] = 930u,  \
         [JOB_BNO_HEALTH] = 500u, [JOB_VERIFY] = 950u, [JOB_RADIO_VERIFY] = 730u, [JOB_MPU_SETUP] = 900u,              \
         [JOB_BNO_SETUP] = 1500u, [JOB_RADIO_SETUP] = 1430u}                                                           \
    }

const nrf24_config radio_config = {RADIO_CHANNEL, RADIO_ADDRESS, RADIO_RETRIES, RADIO_AUTO_ACK};

const board_profile board_profile_default = {
    RATES(5000u, 2500u), {MPU_DLPF_CFG, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV}, BNO_CONFIG};

const board_profile board_profile_fast = {
    RATES(2000u, 1200u), {MPU_DLPF_CFG_FAST, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV_FAST}, BNO_CONFIG};
