#include <stdbool.h>
#include <string.h>

#include "board.h"
#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"

static board b;

static int setup(void **state)
{
    (void)state;
    fake_reset();
    board_init(&b, &board_profile_default, 0);
    return 0;
}

/* Runs until the fake clock shows `until_us` since power-on, as a HAL's main loop does. */
static void run_until(uint64_t until_us)
{
    while (fake.time_us < until_us) {
        const uint32_t wait = board_step(&b) - hal_micros();
        if (wait < 0x80000000u) {
            fake.time_us += wait;
        }
    }
}

static const uint8_t *frame(unsigned index) { return fake.frames[index]; }
static uint8_t type_of(unsigned index) { return frame(index)[0] & 31u; }
static uint16_t u16_at(unsigned index, unsigned offset)
{
    return (uint16_t)(frame(index)[offset] | (unsigned)frame(index)[offset + 1] << 8);
}
static uint32_t time_of(unsigned index) { return u16_at(index, 4) | (uint32_t)u16_at(index, 6) << 16; }

static unsigned count_frames(uint8_t type, unsigned from)
{
    unsigned count = 0;
    for (unsigned i = from; i < fake.sent; ++i) {
        count += type_of(i) == type ? 1u : 0u;
    }
    return count;
}

static unsigned first_frame_after(uint8_t type, uint32_t time_us)
{
    for (unsigned i = 0; i < fake.sent; ++i) {
        if (type_of(i) == type && time_of(i) - fake.start_us >= time_us) {
            return i;
        }
    }
    fail_msg("no frame of type %u after %u us", type, (unsigned)time_us);
    return 0;
}

/* Every frame sound, sequence without a gap, and each type on its grid. */
static void check_stream(uint32_t mpu_period, uint32_t mpu_jitter)
{
    uint32_t last[5] = {0};
    bool seen[5] = {false};
    for (unsigned i = 0; i < fake.sent; ++i) {
        assert_true(frame_is_sound(frame(i)));
        assert_int_equal(u16_at(i, 2), (uint16_t)i);
        const uint8_t type = type_of(i);
        const uint32_t step = time_of(i) - last[type];
        if (seen[type] && type == FRAME_MPU) {
            assert_in_range(step, mpu_period - mpu_jitter, mpu_period + mpu_jitter);
        }
        last[type] = time_of(i);
        seen[type] = true;
    }
    assert_int_equal(fake.radio_overruns, 0);
}

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
        cmocka_unit_test_setup(a_dead_mpu_gives_flagged_frames_and_comes_back, setup),
        cmocka_unit_test_setup(a_dead_bno_gives_flagged_frames, setup),
        cmocka_unit_test_setup(without_any_sensor_the_board_still_talks, setup),
        cmocka_unit_test_setup(a_bno_after_its_own_brown_out_is_set_up_again, setup),
        cmocka_unit_test_setup(radio_troubles_are_counted, setup),
        cmocka_unit_test_setup(a_radio_after_its_own_brown_out_sends_again, setup),
        cmocka_unit_test_setup(without_a_radio_every_frame_is_given_up, setup),
        cmocka_unit_test_setup(every_vital_job_feeds_the_watchdog, setup),
        cmocka_unit_test_setup(a_stuck_bus_is_freed_and_counted, setup),
        cmocka_unit_test_setup(a_stretched_clock_costs_one_frame_and_no_more, setup),
        cmocka_unit_test_setup(a_low_battery_is_flagged, setup),
        cmocka_unit_test_setup(ndof_sends_type_4, setup),
        cmocka_unit_test_setup(a_board_that_stood_still_skips_its_slots, setup),
        cmocka_unit_test_setup(the_age_of_the_sample_is_right, setup),
    };
    return cmocka_run_group_tests_name("board", tests, NULL, NULL);
}
