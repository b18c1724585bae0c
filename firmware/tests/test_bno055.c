#include <stdbool.h>
#include <string.h>

#include "bno055.h"
#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"
#include "i2c.h"

static const bno055_config AMG = {BNO_MODE_AMG,     BNO_ACC_CONFIG,   BNO_MAG_CONFIG,
                                  BNO_GYR_CONFIG_0, BNO_GYR_CONFIG_1, BNO_UNIT_SEL};

static i2c_bus bus;
static bno055 bno;

static int setup(void **state)
{
    (void)state;
    fake_reset();
    bus.errors = 0;
    bno055_init(&bno, &bus, &AMG);
    return 0;
}

/* Steps until ready; returns the number of steps, or fails after `limit`. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(bno_is_configured_on_page_1_and_left_on_page_0, setup),
        cmocka_unit_test_setup(bno_other_configuration_is_written_too, setup),
        cmocka_unit_test_setup(bno_setup_never_waits, setup),
        cmocka_unit_test_setup(bno_setup_survives_a_failure_at_every_transfer, setup),
        cmocka_unit_test_setup(bno_that_stays_silent_is_reset_again_and_again, setup),
        cmocka_unit_test_setup(bno_reads_burst_gyro_and_health, setup),
        cmocka_unit_test_setup(bno_ndof_reads_the_fusion_registers, setup),
        cmocka_unit_test_setup(bno_that_lost_its_mode_is_found_out, setup),
        cmocka_unit_test_setup(bno_failed_reads_end_in_a_new_setup, setup),
    };
    return cmocka_run_group_tests_name("bno055", tests, NULL, NULL);
}
