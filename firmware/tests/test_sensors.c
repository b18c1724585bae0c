#include <stdbool.h>
#include <string.h>

#include "battery.h"
#include "bno055.h"
#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"
#include "i2c.h"
#include "lisy300.h"
#include "mpu6050.h"

static const mpu6050_config MPU = {MPU_DLPF_CFG, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV};
static const bno055_config AMG = {BNO_MODE_AMG,     BNO_ACC_CONFIG,   BNO_MAG_CONFIG,
                                  BNO_GYR_CONFIG_0, BNO_GYR_CONFIG_1, BNO_UNIT_SEL};

static i2c_bus bus;
static mpu6050 mpu;
static bno055 bno;

static int setup(void **state)
{
    (void)state;
    fake_reset();
    bus.errors = 0;
    mpu6050_init(&mpu, &bus, &MPU);
    bno055_init(&bno, &bus, &AMG);
    return 0;
}

/* Steps until ready; returns the number of steps, or fails after `limit`. */
static unsigned set_mpu_up(unsigned limit)
{
    for (unsigned steps = 1; steps <= limit; ++steps) {
        const uint32_t wait = mpu6050_setup_step(&mpu);
        if (wait == 0) {
            return steps;
        }
        fake.time_us += wait;
    }
    fail_msg("MPU-6050 not ready after %u steps", limit);
    return 0;
}

static unsigned set_bno_up(unsigned limit)
{
    for (unsigned steps = 1; steps <= limit; ++steps) {
        const uint32_t wait = bno055_setup_step(&bno);
        if (wait == 0) {
            return steps;
        }
        fake.time_us += wait;
    }
    fail_msg("BNO055 not ready after %u steps", limit);
    return 0;
}

static void mpu_gets_its_configuration(void **state)
{
    (void)state;
    set_mpu_up(4);
    const uint8_t expected[] = {4, 3, 0x08, 0x08};
    assert_memory_equal(&fake.registers.mpu[0x19], expected, 4);
    assert_int_equal(fake.registers.mpu[0x6B], 0x01);
    assert_int_equal(mpu6050_setup_step(&mpu), 0);
    assert_true(mpu6050_verify(&mpu));
    assert_int_equal(bus.errors, 0);
}

static void mpu_burst_is_one_transfer_of_the_data_registers(void **state)
{
    (void)state;
    uint8_t registers[MPU_BURST];
    assert_false(mpu6050_read(&mpu, registers)); /* not set up: zeros, no transfer */
    assert_int_equal(fake.transfers, 0);
    set_mpu_up(4);
    const unsigned before = fake.transfers;
    assert_true(mpu6050_read(&mpu, registers));
    assert_int_equal(fake.transfers, before + 1);
    const int az = (int16_t)(registers[4] << 8 | registers[5]);
    assert_in_range(az, 8192 - 200, 8192 + 200);
}

static void mpu_setup_survives_a_failure_at_every_transfer(void **state)
{
    for (int at = 1; at <= 5; ++at) {
        setup(state);
        fake.fail_at = at;
        assert_true(set_mpu_up(12) > 4);
        assert_int_equal(bus.errors, 1);
        assert_true(mpu6050_verify(&mpu));
    }
}

static void mpu_with_a_wrong_id_is_never_ready(void **state)
{
    (void)state;
    fake.registers.mpu[MPU_REG_WHO_AM_I] = 0x70;
    for (int i = 0; i < 20; ++i) {
        assert_int_equal(mpu6050_setup_step(&mpu), SETUP_RETRY_US);
    }
    assert_int_not_equal(mpu.state, MPU_READY);
}

static void mpu_that_lost_its_configuration_is_found_out(void **state)
{
    (void)state;
    set_mpu_up(4);
    chips_power_on(&fake.registers, 0); /* brown-out of the chip */
    assert_false(mpu6050_verify(&mpu));
    assert_int_not_equal(mpu.state, MPU_READY);
    assert_false(mpu6050_verify(&mpu));
    set_mpu_up(4);
    assert_true(mpu6050_verify(&mpu));
}

static void failed_reads_give_zeros_and_in_the_end_a_new_setup(void **state)
{
    (void)state;
    set_mpu_up(4);
    fake.fail_mpu = HAL_TIMEOUT;
    uint8_t registers[MPU_BURST];
    for (unsigned i = 0; i < READ_FAILURES_BEFORE_SETUP; ++i) {
        assert_int_equal(mpu.state, MPU_READY);
        memset(registers, 0xAA, sizeof registers);
        assert_false(mpu6050_read(&mpu, registers));
        for (unsigned k = 0; k < MPU_BURST; ++k) {
            assert_int_equal(registers[k], 0);
        }
    }
    assert_int_equal(mpu.state, MPU_POWER_UP);
    assert_int_equal(fake.recoveries, READ_FAILURES_BEFORE_SETUP); /* a timeout frees the bus, a NACK would not */
}

static void bno_is_configured_on_page_1_and_left_on_page_0(void **state)
{
    (void)state;
    assert_int_equal(bno055_mode(&bno), BNO_MODE_CONFIG);
    set_bno_up(6);
    const uint8_t expected[] = {0x0D, 0x0B, 0x38, 0x00};
    assert_memory_equal(&fake.registers.bno[1][0x08], expected, 4);
    assert_int_equal(fake.registers.bno[0][BNO_REG_PAGE_ID], 0);
    assert_int_equal(fake.registers.bno[0][BNO_REG_UNIT_SEL], 0);
    assert_int_equal(fake.registers.bno[0][BNO_REG_OPR_MODE], BNO_MODE_AMG);
    assert_int_equal(bno055_mode(&bno), BNO_MODE_AMG);
    assert_int_equal(bno055_setup_step(&bno), 0);
    assert_in_range(fake.time_us, 650000, 1000000);
}

static void bno_other_configuration_is_written_too(void **state)
{
    (void)state;
    const bno055_config other = {BNO_MODE_AMG, 0x11, 0x1B, 0x30, 0x00, 0x82};
    bno055_init(&bno, &bus, &other);
    set_bno_up(6);
    const uint8_t expected[] = {0x11, 0x1B, 0x30, 0x00};
    assert_memory_equal(&fake.registers.bno[1][0x08], expected, 4);
    assert_int_equal(fake.registers.bno[0][BNO_REG_UNIT_SEL], 0x82);
}

static void bno_setup_never_waits(void **state)
{
    (void)state;
    for (int i = 0; i < 6; ++i) {
        const uint64_t before = fake.time_us;
        const uint32_t wait = bno055_setup_step(&bno);
        assert_true(fake.time_us - before < 1100);
        fake.time_us += wait;
    }
    assert_int_equal(bno.state, BNO_READY);
}

static void bno_setup_survives_a_failure_at_every_transfer(void **state)
{
    for (int at = 1; at <= 14; ++at) {
        setup(state);
        fake.fail_at = at;
        assert_true(set_bno_up(20) > 6);
        assert_int_equal(bus.errors, 1);
        assert_true(bno055_verify(&bno));
        assert_int_equal(fake.registers.bno[0][BNO_REG_PAGE_ID], 0);
    }
}

static void bno_that_stays_silent_is_reset_again_and_again(void **state)
{
    (void)state;
    fake.fail_bno = HAL_STUCK;
    uint32_t longest = 0;
    for (int i = 0; i < 40; ++i) {
        const uint32_t wait = bno055_setup_step(&bno);
        assert_true(wait > 0);
        longest = wait > longest ? wait : longest;
        fake.time_us += wait;
    }
    assert_int_equal(longest, 650000);
    assert_int_equal(bus.errors, fake.recoveries);
    fake.fail_bno = HAL_OK;
    set_bno_up(12);
}

static void bno_reads_burst_gyro_and_health(void **state)
{
    (void)state;
    uint8_t registers[BNO_NDOF_BURST];
    uint8_t gyro[BNO_GYR_BYTES];
    assert_false(bno055_read(&bno, registers));
    assert_false(bno055_read_gyro(&bno, gyro));
    assert_false(bno055_read_health(&bno));
    set_bno_up(6);
    const unsigned before = fake.transfers;
    assert_true(bno055_read(&bno, registers));
    assert_int_equal(fake.transfers, before + 1);
    assert_in_range(registers[4] | registers[5] << 8, 981 - 12, 981 + 12);
    assert_true(bno055_read_gyro(&bno, gyro));
    assert_memory_equal(gyro, &registers[BNO_GYR_IN_BURST], BNO_GYR_BYTES);
    assert_true(bno055_read_health(&bno));
    assert_int_equal(bno.temperature, 25);
}

static void bno_ndof_reads_the_fusion_registers(void **state)
{
    (void)state;
    bno055_config ndof = AMG;
    ndof.mode = BNO_MODE_NDOF;
    bno055_init(&bno, &bus, &ndof);
    set_bno_up(6);
    uint8_t registers[BNO_NDOF_BURST];
    assert_true(bno055_read(&bno, registers));
    assert_int_equal(registers[6] | registers[7] << 8, 16384); /* quaternion w = 1 */
    assert_true(bno055_read_health(&bno));
    assert_int_equal(bno.calib_stat, 0xFF);
}

static void bno_that_lost_its_mode_is_found_out(void **state)
{
    (void)state;
    set_bno_up(6);
    assert_true(bno055_verify(&bno));
    fake.fail_bno = HAL_NACK;
    assert_true(bno055_verify(&bno)); /* silence alone is left to the reads */
    fake.fail_bno = HAL_OK;
    fake.registers.bno[0][BNO_REG_OPR_MODE] = BNO_MODE_CONFIG;
    assert_false(bno055_verify(&bno));
    assert_int_equal(bno055_mode(&bno), BNO_MODE_CONFIG);
    assert_false(bno055_verify(&bno));
    set_bno_up(6);
    assert_true(bno055_verify(&bno));
}

static void bno_failed_reads_end_in_a_new_setup(void **state)
{
    (void)state;
    set_bno_up(6);
    fake.fail_bno = HAL_NACK;
    uint8_t registers[BNO_NDOF_BURST];
    for (unsigned i = 0; i < READ_FAILURES_BEFORE_SETUP; ++i) {
        assert_int_equal(bno.state, BNO_READY);
        assert_false(bno055_read(&bno, registers));
    }
    assert_int_equal(bno.state, BNO_IDENTIFY);
    assert_int_equal(fake.recoveries, 0);
}

static void i2c_error_counter_stops_at_255(void **state)
{
    (void)state;
    fake.fail_mpu = HAL_STUCK;
    for (int i = 0; i < 300; ++i) {
        assert_false(i2c_write_byte(&bus, MPU_ADDRESS, 0x19, 0));
    }
    assert_int_equal(bus.errors, 255);
    assert_int_equal(fake.recoveries, 300);
}

static void lisy_sums_16_conversions(void **state)
{
    (void)state;
    assert_int_equal(lisy300_sum(), 16 * 512);
    fake.adc[HAL_ADC_LISY] = 1023;
    assert_int_equal(lisy300_sum(), 16368);
}

static void battery_is_in_millivolt_and_low_with_hysteresis(void **state)
{
    (void)state;
    const struct {
        uint16_t code;
        uint16_t millivolt;
        bool low;
    } steps[] = {{605, 3899, false}, {515, 3319, false}, {511, 3294, true}, {520, 3352, true},
                 {528, 3403, false}, {0, 0, true},       {1023, 6594, false}};
    battery cell = {0, false};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; ++i) {
        fake.adc[HAL_ADC_BATTERY] = steps[i].code;
        battery_read(&cell);
        assert_int_equal(cell.millivolt, steps[i].millivolt);
        assert_int_equal(cell.low, steps[i].low);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(mpu_gets_its_configuration, setup),
        cmocka_unit_test_setup(mpu_burst_is_one_transfer_of_the_data_registers, setup),
        cmocka_unit_test_setup(mpu_setup_survives_a_failure_at_every_transfer, setup),
        cmocka_unit_test_setup(mpu_with_a_wrong_id_is_never_ready, setup),
        cmocka_unit_test_setup(mpu_that_lost_its_configuration_is_found_out, setup),
        cmocka_unit_test_setup(failed_reads_give_zeros_and_in_the_end_a_new_setup, setup),
        cmocka_unit_test_setup(bno_is_configured_on_page_1_and_left_on_page_0, setup),
        cmocka_unit_test_setup(bno_other_configuration_is_written_too, setup),
        cmocka_unit_test_setup(bno_setup_never_waits, setup),
        cmocka_unit_test_setup(bno_setup_survives_a_failure_at_every_transfer, setup),
        cmocka_unit_test_setup(bno_that_stays_silent_is_reset_again_and_again, setup),
        cmocka_unit_test_setup(bno_reads_burst_gyro_and_health, setup),
        cmocka_unit_test_setup(bno_ndof_reads_the_fusion_registers, setup),
        cmocka_unit_test_setup(bno_that_lost_its_mode_is_found_out, setup),
        cmocka_unit_test_setup(bno_failed_reads_end_in_a_new_setup, setup),
        cmocka_unit_test_setup(i2c_error_counter_stops_at_255, setup),
        cmocka_unit_test_setup(lisy_sums_16_conversions, setup),
        cmocka_unit_test_setup(battery_is_in_millivolt_and_low_with_hysteresis, setup),
    };
    return cmocka_run_group_tests_name("sensors", tests, NULL, NULL);
}
