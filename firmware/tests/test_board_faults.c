#include <string.h>

#include "board_on_bench.h"

static void a_dead_mpu_gives_flagged_frames_and_comes_back(void **state)
{
    (void)state;
    run_until(2000000);
    fake.fail_mpu = HAL_STUCK;
    run_until(3000000);
    unsigned at = first_frame_after(FRAME_MPU, 2500000);
    assert_int_equal(frame(at)[1] & FRAME_FLAG_READ_FAILED, FRAME_FLAG_READ_FAILED);
    for (unsigned k = FRAME_BODY; k < FRAME_BODY + MPU_BURST; ++k) {
        assert_int_equal(frame(at)[k], 0);
    }
    assert_true(frame(at)[27] >= 10);
    assert_true(count_frames(FRAME_BNO_AMG, at) > 0);
    fake.fail_mpu = HAL_OK;
    run_until(4000000);
    at = first_frame_after(FRAME_MPU, 3500000);
    assert_int_equal(frame(at)[1] & FRAME_FLAG_READ_FAILED, 0);
    check_stream(5000, 5000);
}

static void a_dead_bno_gives_flagged_frames(void **state)
{
    (void)state;
    fake.fail_bno = HAL_NACK;
    run_until(3000000);
    const unsigned first = first_frame_after(FRAME_BNO_AMG, 0);
    assert_true(time_of(first) >= 1000000);
    assert_int_equal(frame(first)[1] & FRAME_FLAG_READ_FAILED, FRAME_FLAG_READ_FAILED);
    assert_int_equal(count_frames(FRAME_BNO_AMG, 0), 200);
    check_stream(5000, 0);
}

static void without_any_sensor_the_board_still_talks(void **state)
{
    (void)state;
    fake.fail_mpu = HAL_NACK;
    fake.fail_bno = HAL_NACK;
    run_until(3000000);
    assert_int_equal(type_of(0), FRAME_STATUS);
    assert_in_range(time_of(0), 1000000, 1100000);
    assert_in_range(count_frames(FRAME_MPU, 0), 390, 401);
    check_stream(5000, 0);
}

static void a_bno_after_its_own_brown_out_is_set_up_again(void **state)
{
    (void)state;
    run_until(2000000);
    chips fresh;
    chips_power_on(&fresh, fake.time_us * 1000u);
    memcpy(fake.registers.bno, fresh.bno, sizeof fresh.bno);
    run_until(5000000);
    const unsigned last = first_frame_after(FRAME_BNO_AMG, 4900000);
    assert_int_equal(frame(last)[1] & FRAME_FLAG_READ_FAILED, 0);
    assert_in_range(u16_at(last, 12), 960, 1000); /* gravity again */
}

static void radio_troubles_are_counted(void **state)
{
    (void)state;
    run_until(1500000);
    fake.air.lose = 1;
    run_until(4000000);
    const unsigned last = first_frame_after(FRAME_MPU, 3990000);
    assert_int_equal(frame(last)[26], 255);
    assert_int_equal(frame(last)[28], RADIO_RETRIES);
    check_stream(5000, 0);
    fake.air.lose = 0;
    run_until(4100000);
    const unsigned after = first_frame_after(FRAME_MPU, 4050000);
    assert_int_equal(frame(after)[26], 255);
    assert_int_equal(frame(after)[28], 0);
}

static void a_radio_after_its_own_brown_out_sends_again(void **state)
{
    (void)state;
    run_until(2000000);
    nrf_chip_reset(&fake.air.sender);
    run_until(3100000);
    assert_int_equal(b.radio.state, NRF24_READY);
    assert_in_range(b.radio.restarts, 1, 255);
    const uint64_t before = fake.air.frames - fake.air.undelivered;
    run_until(4100000);
    assert_in_range(fake.air.frames - fake.air.undelivered - before, 300, 302);
}

static void without_a_radio_every_frame_is_given_up(void **state)
{
    (void)state;
    fake.radio_dead = true;
    run_until(3000000);
    assert_int_equal(fake.sent, 0);
    assert_int_equal(b.radio.given_up, 255);
    assert_in_range(b.sequence, 700, 900);
    fake.radio_dead = false;
    run_until(3300000);
    assert_in_range(fake.sent, 30, 90);
    assert_true(u16_at(0, 2) >= 700);
}

static void a_stuck_bus_is_freed_and_counted(void **state)
{
    (void)state;
    run_until(2000000);
    fake.fail_mpu = HAL_STUCK;
    fake.sda_clocks = 9;
    run_until(2006000);
    fake.fail_mpu = HAL_OK;
    run_until(2100000);
    assert_in_range(b.bus.recoveries, 1, 2);
    assert_int_equal(b.bus.stuck, 0);
    assert_int_equal(b.bus.timeouts, 0);
    assert_int_equal(frame(first_frame_after(FRAME_MPU, 2050000))[1] & FRAME_FLAG_READ_FAILED, 0);
}

static void a_stretched_clock_costs_one_frame_and_no_more(void **state)
{
    (void)state;
    run_until(2000000);
    fake.fail_bno = HAL_TIMEOUT;
    run_until(2015000);
    fake.fail_bno = HAL_OK;
    run_until(2200000);
    assert_in_range(b.bus.timeouts, 1, 4);
    assert_int_equal(b.bus.recoveries, b.bus.timeouts);
    const unsigned at = first_frame_after(FRAME_BNO_AMG, 2100000);
    assert_int_equal(frame(at)[1] & FRAME_FLAG_READ_FAILED, 0);
    assert_int_equal(b.slots.skipped, 0);
}

static void a_board_that_stood_still_skips_its_slots(void **state)
{
    (void)state;
    run_until(2000000);
    fake.time_us += 3000000;
    run_until(6000000);
    assert_in_range(b.slots.skipped, 800, 1000);
    const unsigned at = first_frame_after(FRAME_STATUS, 5500000);
    assert_int_equal(u16_at(at, 24), (time_of(at)) / 1000000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_dead_mpu_gives_flagged_frames_and_comes_back, setup),
        cmocka_unit_test_setup(a_dead_bno_gives_flagged_frames, setup),
        cmocka_unit_test_setup(without_any_sensor_the_board_still_talks, setup),
        cmocka_unit_test_setup(a_bno_after_its_own_brown_out_is_set_up_again, setup),
        cmocka_unit_test_setup(radio_troubles_are_counted, setup),
        cmocka_unit_test_setup(a_radio_after_its_own_brown_out_sends_again, setup),
        cmocka_unit_test_setup(without_a_radio_every_frame_is_given_up, setup),
        cmocka_unit_test_setup(a_stuck_bus_is_freed_and_counted, setup),
        cmocka_unit_test_setup(a_stretched_clock_costs_one_frame_and_no_more, setup),
        cmocka_unit_test_setup(a_board_that_stood_still_skips_its_slots, setup),
    };
    return cmocka_run_group_tests_name("board faults", tests, NULL, NULL);
}
