#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"
#include "i2c.h"

static i2c_bus bus;

static int setup(void **state)
{
    (void)state;
    fake_reset();
    bus = (i2c_bus){0};
    return 0;
}

static bool read_one(void)
{
    uint8_t value;
    return i2c_read(&bus, MPU_ADDRESS, 0x75, &value, 1);
}

static void a_refusal_is_counted_and_leaves_the_bus_alone(void **state)
{
    (void)state;
    fake.fail_mpu = HAL_NACK;
    assert_false(read_one());
    assert_int_equal(bus.errors, 1);
    assert_int_equal(fake.recoveries, 0);
}

static void a_chip_in_the_middle_of_a_byte_is_clocked_to_its_end(void **state)
{
    (void)state;
    for (unsigned clocks = 1; clocks <= 9; ++clocks) {
        setup(NULL);
        fake.sda_clocks = clocks;
        fake.fail_mpu = HAL_STUCK;
        assert_false(read_one());
        assert_int_equal(fake.sda_clocks, 0);
        assert_int_equal(bus.recoveries, 1);
        assert_int_equal(bus.stuck, 0);
        assert_int_equal(fake.recoveries, 1); /* the peripheral has the lines back */
        fake.fail_mpu = HAL_OK;
        assert_true(read_one());
    }
}

static void a_shorted_line_ends_the_attempt_and_is_counted(void **state)
{
    (void)state;
    fake.sda_short = true;
    fake.fail_mpu = HAL_STUCK;
    const uint64_t before = fake.time_us;
    assert_false(read_one());
    assert_int_equal(bus.stuck, 1);
    assert_in_range(fake.scl_clocks, 9, 11);
    assert_true(fake.time_us - before < 3000);
}

static void a_deadline_is_told_apart(void **state)
{
    (void)state;
    fake.fail_mpu = HAL_TIMEOUT;
    assert_false(read_one());
    assert_false(i2c_write_byte(&bus, MPU_ADDRESS, 0x19, 4));
    assert_int_equal(bus.errors, 2);
    assert_int_equal(bus.timeouts, 2);
    assert_int_equal(bus.recoveries, 2);
}

static void counters_stop_at_their_end(void **state)
{
    (void)state;
    fake.fail_mpu = HAL_STUCK;
    fake.sda_short = true;
    for (int i = 0; i < 300; ++i) {
        assert_false(read_one());
    }
    assert_int_equal(bus.errors, 255);
    assert_int_equal(bus.recoveries, 255);
    assert_int_equal(bus.stuck, 255);
}

static void failed_writes_are_counted_up_to_255(void **state)
{
    (void)state;
    fake.fail_mpu = HAL_STUCK;
    for (int i = 0; i < 300; ++i) {
        assert_false(i2c_write_byte(&bus, MPU_ADDRESS, 0x19, 0));
    }
    assert_int_equal(bus.errors, 255);
    assert_int_equal(fake.recoveries, 300);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_refusal_is_counted_and_leaves_the_bus_alone, setup),
        cmocka_unit_test_setup(a_chip_in_the_middle_of_a_byte_is_clocked_to_its_end, setup),
        cmocka_unit_test_setup(a_shorted_line_ends_the_attempt_and_is_counted, setup),
        cmocka_unit_test_setup(a_deadline_is_told_apart, setup),
        cmocka_unit_test_setup(counters_stop_at_their_end, setup),
        cmocka_unit_test_setup(failed_writes_are_counted_up_to_255, setup),
    };
    return cmocka_run_group_tests_name("i2c", tests, NULL, NULL);
}
