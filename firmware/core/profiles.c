/* The rates table: period, phase, cost of every job in us. Costs are measured times at 8 MIPS, rounded up. */
#include "board.h"
#include "config.h"

#define BNO_CONFIG                                                                                                     \
    {                                                                                                                  \
        BNO_MODE_AMG, BNO_ACC_CONFIG, BNO_MAG_CONFIG, BNO_GYR_CONFIG_0, BNO_GYR_CONFIG_1, BNO_UNIT_SEL                 \
    }

#define RATES(mpu_period_us, bno_phase_us)                                                                             \
    {                                                                                                                  \
        [JOB_MPU] = {(mpu_period_us), 0u, 1300u}, [JOB_BNO_READ] = {10000u, (bno_phase_us), 650u},                     \
        [JOB_BNO_SEND] = {0u, 0u, 600u}, [JOB_BNO_LOOK] = {0u, 0u, 300u}, [JOB_STATUS] = {1000000u, 50000u, 600u},     \
        [JOB_BNO_HEALTH] = {100000u, 3000u, 200u}, [JOB_VERIFY] = {1000000u, 53000u, 650u},                            \
        [JOB_RADIO_VERIFY] = {1000000u, 58000u, 300u}, [JOB_MPU_SETUP] = {0u, 0u, 600u},                              \
        [JOB_BNO_SETUP] = {0u, 0u, 1000u}, [JOB_RADIO_SETUP] = {0u, 0u, 1000u}                                         \
    }

const nrf24_config radio_config = {RADIO_CHANNEL, RADIO_ADDRESS, RADIO_RETRIES, RADIO_AUTO_ACK};

const board_profile board_profile_default = {
    RATES(5000u, 2500u), {MPU_DLPF_CFG, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV}, BNO_CONFIG};

const board_profile board_profile_fast = {
    RATES(2000u, 1300u), {MPU_DLPF_CFG_FAST, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV_FAST}, BNO_CONFIG};
