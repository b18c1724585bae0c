/* A board whose HAL and chips are emulated, and the frames that it has sent. */
#ifndef GSENSE_BOARD_ON_BENCH_H
#define GSENSE_BOARD_ON_BENCH_H

#include <stdbool.h>

#include "board.h"
#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"

static board b;

static inline int setup(void **state)
{
    (void)state;
    fake_reset();
    board_init(&b, &board_profile_default, 0);
    return 0;
}

/* Runs until the fake clock shows `until_us` since power-on, as a HAL's main loop does. */
static inline void run_until(uint64_t until_us)
{
    while (fake.time_us < until_us) {
        const uint32_t wait = board_step(&b) - hal_micros();
        if (wait < 0x80000000u) {
            fake.time_us += wait;
        }
    }
}

static const uint8_t *frame(unsigned index) { return fake.frames[index]; }
static inline uint8_t type_of(unsigned index) { return frame(index)[0] & 31u; }
static inline uint16_t u16_at(unsigned index, unsigned offset)
{
    return (uint16_t)(frame(index)[offset] | (unsigned)frame(index)[offset + 1] << 8);
}
static inline uint32_t time_of(unsigned index) { return u16_at(index, 4) | (uint32_t)u16_at(index, 6) << 16; }

static inline unsigned count_frames(uint8_t type, unsigned from)
{
    unsigned count = 0;
    for (unsigned i = from; i < fake.sent; ++i) {
        count += type_of(i) == type ? 1u : 0u;
    }
    return count;
}

static inline unsigned first_frame_after(uint8_t type, uint32_t time_us)
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
static inline void check_stream(uint32_t mpu_period, uint32_t mpu_jitter)
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

#endif
