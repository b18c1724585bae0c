#include <stdbool.h>
#include <string.h>

#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"
#include "i2c.h"
#include "mpu6050.h"

static const mpu6050_config MPU = {MPU_DLPF_CFG, MPU_FS_SEL, MPU_AFS_SEL, MPU_SMPLRT_DIV};

static i2c_bus bus;
static mpu6050 mpu;

static int setup(void **state)
{
    (void)state;
    fake_reset();
    bus.errors = 0;
    mpu6050_init(&mpu, &bus, &MPU);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(mpu_gets_its_configuration, setup),
        cmocka_unit_test_setup(mpu_burst_is_one_transfer_of_the_data_registers, setup),
        cmocka_unit_test_setup(mpu_setup_survives_a_failure_at_every_transfer, setup),
        cmocka_unit_test_setup(mpu_with_a_wrong_id_is_never_ready, setup),
        cmocka_unit_test_setup(mpu_that_lost_its_configuration_is_found_out, setup),
        cmocka_unit_test_setup(failed_reads_give_zeros_and_in_the_end_a_new_setup, setup),
    };
    return cmocka_run_group_tests_name("mpu6050", tests, NULL, NULL);
}
