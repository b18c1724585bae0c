#include <stdbool.h>
#include <string.h>

#include "cmocka_all.h"
#include "counters.h"
#include "scheduler.h"

enum { FAST = 0, SLOW = 1, ONCE = 2 };

static const scheduler_rates RATES = {
    .period_us = {[FAST] = 5000, [SLOW] = 10000}, .phase_us = {[SLOW] = 2500}, .cost_us = {[FAST] = 1300, [SLOW] = 600, [ONCE] = 600}};

static void slots_stay_on_their_grid_across_the_wrap(void **state)
{
    (void)state;
    scheduler s;
    const uint32_t start = UINT32_MAX - 1000000u; /* wraps after 1 s */
    uint32_t now = start;
    scheduler_start(&s, &RATES, now);
    unsigned runs[2] = {0, 0};
    while (now - start < 2000000u) {
        const uint8_t job = scheduler_take(&s, now);
        if (job != SCHEDULER_NONE) {
            assert_true(job <= SLOW);
            assert_int_equal(now - start, runs[job] * RATES.period_us[job] + RATES.phase_us[job]);
            ++runs[job];
            now += RATES.cost_us[job];
        } else {
            now = s.next_us;
        }
    }
    assert_int_equal(runs[FAST], 400);
    assert_int_equal(runs[SLOW], 200);
    assert_int_equal(s.skipped, 0);
}

static void a_job_waits_when_it_would_reach_into_a_more_important_slot(void **state)
{
    (void)state;
    scheduler s;
    scheduler_start(&s, &RATES, 0);
    assert_int_equal(scheduler_take(&s, 0), FAST);
    assert_int_equal(scheduler_take(&s, 2500), SLOW);
    scheduler_arm(&s, ONCE, 4500); /* 600 us long: would end at 5100 */
    assert_int_equal(scheduler_take(&s, 4500), SCHEDULER_NONE);
    assert_int_equal(s.next_us, 5000);
    assert_int_equal(scheduler_take(&s, 5000), FAST);
    assert_int_equal(scheduler_take(&s, 6300), ONCE);
    assert_int_equal(scheduler_take(&s, 6900), SCHEDULER_NONE); /* once */
}

static void patience_ends(void **state)
{
    (void)state;
    static const scheduler_rates tight = {.period_us = {[FAST] = 1000, [SLOW] = 10000}, .cost_us = {[FAST] = 900, [SLOW] = 600}};
    scheduler s;
    scheduler_start(&s, &tight, 0);
    uint32_t now = 0;
    bool ran = false;
    while (now < 30000u && !ran) {
        const uint8_t job = scheduler_take(&s, now);
        ran = job == SLOW;
        now += job == FAST ? 900u : 0u;
        now = job == SCHEDULER_NONE ? s.next_us : now;
    }
    assert_true(ran);
    assert_in_range(now, SCHEDULER_PATIENCE_US, SCHEDULER_PATIENCE_US + 2000u);
}

static void missed_slots_are_skipped_and_counted(void **state)
{
    (void)state;
    scheduler s;
    scheduler_start(&s, &RATES, 0);
    assert_int_equal(scheduler_take(&s, 17000), FAST); /* due at 0; 5000, 10000 and 15000 are lost */
    assert_int_equal(s.skipped, 3);
    assert_int_equal(scheduler_take(&s, 17000), SLOW); /* due at 2500; 12500 is lost */
    assert_int_equal(s.skipped, 4);
    assert_int_equal(scheduler_take(&s, 17000), SCHEDULER_NONE);
    assert_int_equal(s.next_us, 20000);
    s.skipped = UINT16_MAX;
    assert_int_equal(scheduler_take(&s, 99000), FAST);
    assert_int_equal(s.skipped, UINT16_MAX);
}

static void a_late_slot_runs_at_once_and_the_next_is_on_the_grid(void **state)
{
    (void)state;
    scheduler s;
    scheduler_start(&s, &RATES, 0);
    assert_int_equal(scheduler_take(&s, 1900), FAST);
    assert_int_equal(s.due_us[FAST], 5000);
    assert_int_equal(s.skipped, 0);
}

static void nothing_armed_is_no_end(void **state)
{
    (void)state;
    static const scheduler_rates none = {{0}, {0}, {0}};
    scheduler s;
    scheduler_start(&s, &none, 5);
    assert_int_equal(scheduler_take(&s, 5), SCHEDULER_NONE);
    assert_true(s.next_us > 5);
    scheduler_arm(&s, ONCE, 7);
    scheduler_disarm(&s, ONCE);
    assert_int_equal(scheduler_take(&s, 8), SCHEDULER_NONE);
}

static void counters_stop_at_their_end(void **state)
{
    (void)state;
    uint8_t counter = 254;
    count_u8(&counter);
    assert_int_equal(counter, 255);
    count_u8(&counter);
    assert_int_equal(counter, 255);
    assert_int_equal(saturate_u16(65535), 65535);
    assert_int_equal(saturate_u16(65536), 65535);
    assert_true(time_reached(5, 0xFFFFFFF0u));
    assert_false(time_reached(0xFFFFFFF0u, 5));
    assert_true(time_reached(7, 7));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slots_stay_on_their_grid_across_the_wrap),
        cmocka_unit_test(a_job_waits_when_it_would_reach_into_a_more_important_slot),
        cmocka_unit_test(patience_ends),
        cmocka_unit_test(missed_slots_are_skipped_and_counted),
        cmocka_unit_test(a_late_slot_runs_at_once_and_the_next_is_on_the_grid),
        cmocka_unit_test(nothing_armed_is_no_end),
        cmocka_unit_test(counters_stop_at_their_end),
    };
    return cmocka_run_group_tests_name("scheduler", tests, NULL, NULL);
}
