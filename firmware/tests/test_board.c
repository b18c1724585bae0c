#include "board_on_bench.h"

static void streams_200_and_100_hz(void **state)
{
    (void)state;
    run_until(3000000);
    const unsigned before = fake.sent;
    run_until(5000000);
    check_stream(5000, 0);
    assert_int_equal(count_frames(FRAME_MPU, before), 400);
    assert_int_equal(count_frames(FRAME_BNO_AMG, before), 200);
    assert_int_equal(count_frames(FRAME_STATUS, before), 2);
    assert_int_equal(b.slots.skipped, 0);
    assert_true(fake.kicks > fake.sent);
}

static void fast_profile_streams_500_and_100_hz(void **state)
{
    (void)state;
    board_init(&b, &board_profile_fast, 0);
    run_until(3000000);
    const unsigned before = fake.sent;
    run_until(5000000);
    check_stream(2000, 0);
    assert_int_equal(count_frames(FRAME_MPU, before), 1000);
    assert_int_equal(count_frames(FRAME_BNO_AMG, before), 200);
    assert_int_equal(fake.registers.mpu[0x1A], 1);
    assert_int_equal(fake.registers.mpu[0x19], 1);
}

static void board_time_wraps_without_a_gap(void **state)
{
    (void)state;
    fake.start_us = UINT32_MAX - 2000000u;
    board_init(&b, &board_profile_default, 0);
    run_until(4000000);
    check_stream(5000, 0);
    assert_true(hal_micros() < 3000000u);
    const unsigned last_status = first_frame_after(FRAME_STATUS, 3000000);
    assert_int_equal(u16_at(last_status, 24), 3);
}

static void scales_are_told_before_the_first_sample(void **state)
{
    (void)state;
    run_until(1500000);
    assert_int_equal(type_of(0), FRAME_STATUS);
    const uint8_t before_bno[] = {FIRMWARE_MAJOR, FIRMWARE_MINOR, 3, 0x11, 4, 0, 0x0D, 0x38, 0, 0x0B, RESET_BROWN_OUT, 0};
    assert_memory_equal(frame(0) + FRAME_BODY, before_bno, sizeof before_bno);
    assert_int_equal(u16_at(0, 20), 5000);
    assert_int_equal(u16_at(0, 22), 10000);
    const unsigned first_bno = first_frame_after(FRAME_BNO_AMG, 0);
    assert_int_equal(frame(first_bno)[1] & FRAME_FLAG_READ_FAILED, 0);
    unsigned told = 0;
    for (unsigned i = 0; i < fake.sent; ++i) {
        told += type_of(i) == FRAME_STATUS && frame(i)[13] == BNO_MODE_AMG ? 1u : 0u;
    }
    assert_true(told >= 1);
}

static void the_started_flag_ends_after_a_second(void **state)
{
    (void)state;
    run_until(2000000);
    for (unsigned i = 0; i < fake.sent; ++i) {
        const bool early = time_of(i) < 990000;
        const bool late = time_of(i) > 1010000;
        if (early || late) {
            assert_int_equal((frame(i)[1] & FRAME_FLAG_STARTED) != 0, early);
        }
    }
}

static void every_vital_job_feeds_the_watchdog(void **state)
{
    (void)state;
    run_until(3000000);
    unsigned kicks = fake.kicks;
    run_until(3100000);
    assert_true(fake.kicks > kicks);
    scheduler_disarm(&b.slots, JOB_BNO_READ); /* a job that starves */
    run_until(7000000);
    kicks = fake.kicks;
    run_until(8000000);
    assert_int_equal(fake.kicks, kicks);
    scheduler_arm(&b.slots, JOB_BNO_READ, hal_micros());
    run_until(12000000);
    assert_true(fake.kicks > kicks);
}

static void a_low_battery_is_flagged(void **state)
{
    (void)state;
    run_until(2000000);
    fake.adc[HAL_ADC_BATTERY] = 500;
    run_until(2100000);
    assert_int_equal(frame(first_frame_after(FRAME_MPU, 2050000))[1], FRAME_FLAG_BATTERY_LOW);
}

static void ndof_sends_type_4(void **state)
{
    (void)state;
    board_init(&b, &board_profile_default, BNO_MODE_NDOF);
    run_until(3000000);
    assert_int_equal(count_frames(FRAME_BNO_AMG, 0), 0);
    const unsigned at = first_frame_after(FRAME_BNO_NDOF, 2000000);
    assert_int_equal(u16_at(at, 14), 16384);
    assert_int_equal(frame(at)[28], 0xFF);
    assert_int_equal(frame(at)[29], 25);
    assert_int_equal(frame(first_frame_after(FRAME_STATUS, 2000000))[13], BNO_MODE_NDOF);
    check_stream(5000, 0);
}

/* Against the truth that the bench's chip has: a sample every 10.03 ms. */
static void the_age_of_the_sample_is_right(void **state)
{
    (void)state;
    run_until(6000000);
    unsigned checked = 0;
    unsigned wrong = 0;
    for (unsigned i = 0; i < fake.sent; ++i) {
        if (type_of(i) == FRAME_BNO_AMG && time_of(i) > 3000000) {
            const int truth = (int)(time_of(i) % 10030u);
            const int age = u16_at(i, 28);
            ++checked;
            wrong += age - truth > 1000 || truth - age > 1000 ? 1u : 0u;
        }
    }
    print_message("%u of %u ages off by more than 1 ms\n", wrong, checked);
    assert_true(checked >= 299);
    assert_true(wrong * 20 < checked);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(streams_200_and_100_hz, setup),
        cmocka_unit_test_setup(fast_profile_streams_500_and_100_hz, setup),
        cmocka_unit_test_setup(board_time_wraps_without_a_gap, setup),
        cmocka_unit_test_setup(scales_are_told_before_the_first_sample, setup),
        cmocka_unit_test_setup(the_started_flag_ends_after_a_second, setup),
        cmocka_unit_test_setup(every_vital_job_feeds_the_watchdog, setup),
        cmocka_unit_test_setup(a_low_battery_is_flagged, setup),
        cmocka_unit_test_setup(ndof_sends_type_4, setup),
        cmocka_unit_test_setup(the_age_of_the_sample_is_right, setup),
    };
    return cmocka_run_group_tests_name("board", tests, NULL, NULL);
}
