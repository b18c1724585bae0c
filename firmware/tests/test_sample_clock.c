#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "cmocka_all.h"
#include "sample_clock.h"

#define NOMINAL 10000

/* A chip whose sample k comes at 3333 + k * period, and which repeats every `equal_every`-th one (0: none). */
typedef struct {
    int64_t period_ns;
    unsigned equal_every;
} chip;

static int64_t newest_sample(const chip *c, int64_t time_us) { return (time_us * 1000 - 3333000) / c->period_ns; }

static void registers(const chip *c, int64_t time_us, uint8_t bytes[SAMPLE_BYTES])
{
    int64_t k = newest_sample(c, time_us);
    if (c->equal_every != 0 && k % c->equal_every == 0) {
        --k;
    }
    for (unsigned i = 0; i < SAMPLE_BYTES; ++i) {
        bytes[i] = (uint8_t)(k >> (8 * i));
    }
}

/* The bus is taken from 0 to 1300 us in every 5 ms, and a look takes 300 us. */
static int64_t when_free(int64_t time_us)
{
    const int64_t phase = time_us % 5000;
    return phase < 1300 ? time_us + 1300 - phase : phase > 4700 ? time_us + 6300 - phase : time_us;
}

static void extra_looks(const chip *c, sample_clock *clock, int64_t read_us, uint32_t offset)
{
    int64_t free_at = read_us + 600;
    for (;;) {
        const int64_t wanted = read_us + (int32_t)(sample_clock_next_look(clock) - (uint32_t)(read_us + offset));
        const int64_t at = when_free(wanted > free_at ? wanted : free_at);
        if (at > read_us + NOMINAL - 300) {
            return;
        }
        uint8_t bytes[SAMPLE_BYTES];
        registers(c, at, bytes);
        sample_clock_look(clock, (uint32_t)(at + offset), bytes);
        free_at = at + 250;
    }
}

/* Share in 1/1000 of the reads after 3 s whose age is wrong by more than `tolerance_us`, in 30 s across the wrap. */
static int wrong_ages(const chip *c, int64_t tolerance_us)
{
    const uint32_t offset = UINT32_MAX - 10000000u;
    sample_clock clock;
    sample_clock_init(&clock, NOMINAL);
    int wrong = 0;
    for (int i = 1; i < 3000; ++i) {
        const int64_t read_us = 2500 + (int64_t)NOMINAL * i;
        uint8_t bytes[SAMPLE_BYTES];
        registers(c, read_us, bytes);
        sample_clock_look(&clock, (uint32_t)(read_us + offset), bytes);
        const int64_t truth = read_us - (3333000 + newest_sample(c, read_us) * c->period_ns) / 1000;
        const int64_t error = sample_clock_age(&clock, (uint32_t)(read_us + offset)) - truth;
        wrong += i > 300 && (error > tolerance_us || error < -tolerance_us) ? 1 : 0;
        extra_looks(c, &clock, read_us, offset);
    }
    return wrong * 1000 / 2700;
}

static const int64_t PERIODS_NS[] = {9700000, 9900000, 9970000, 9995000, 10000000, 10000500, 10007000, 10030000, 10300000};

static void ages_are_right_for_any_clock_of_the_chip(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof PERIODS_NS / sizeof PERIODS_NS[0]; ++i) {
        const chip c = {PERIODS_NS[i], 0};
        const int wrong = wrong_ages(&c, 1000); /* what the MPU's slot hides */
        print_message("period %ld ns: %d/1000 ages off by more than 1 ms, %d/1000 by more than 0.3 ms\n",
                      (long)PERIODS_NS[i], wrong, wrong_ages(&c, 300));
        assert_true(wrong <= 20);
    }
}

static void equal_samples_do_little_harm(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof PERIODS_NS / sizeof PERIODS_NS[0]; ++i) {
        const chip c = {PERIODS_NS[i], 67};
        assert_true(wrong_ages(&c, 1000) <= 40);
    }
}

static void a_long_pause_starts_it_over(void **state)
{
    (void)state;
    const uint8_t first[SAMPLE_BYTES] = {1};
    const uint8_t second[SAMPLE_BYTES] = {2};
    sample_clock clock;
    sample_clock_init(&clock, NOMINAL);
    assert_int_equal(sample_clock_age(&clock, 5), 0);
    sample_clock_look(&clock, 1000, first);
    sample_clock_look(&clock, 4000, first);
    assert_int_equal(sample_clock_age(&clock, 4000), 3000);
    assert_int_equal(sample_clock_age(&clock, 100000), 65535);
    sample_clock_look(&clock, 4000 + 65 * NOMINAL, first);
    assert_int_equal(sample_clock_age(&clock, 4000 + 65 * NOMINAL), 0);
    sample_clock_look(&clock, 8000 + 65 * NOMINAL, second);
    assert_int_equal(sample_clock_age(&clock, 9000 + 65 * NOMINAL), 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ages_are_right_for_any_clock_of_the_chip),
        cmocka_unit_test(equal_samples_do_little_harm),
        cmocka_unit_test(a_long_pause_starts_it_over),
    };
    return cmocka_run_group_tests_name("sample_clock", tests, NULL, NULL);
}
