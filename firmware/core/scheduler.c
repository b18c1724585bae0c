#include "scheduler.h"

#include "counters.h"

#define AHEAD 0x80000000u /* differences from here on are of times that are still to come */
#define IDLE_US 1000000u /* nothing armed: look again after this */

/* The earliest of the others; `now` where one is overdue. */
static void find_others_due(scheduler *s, uint32_t now)
{
    uint32_t wait = IDLE_US;
    for (uint8_t job = SCHEDULER_FREQUENT; job < SCHEDULER_JOBS; ++job) {
        if (!s->armed[job]) {
            continue;
        }
        if (time_reached(now, s->due_us[job])) {
            s->others_due_us = now;
            return;
        }
        const uint32_t ahead = s->due_us[job] - now;
        if (ahead < wait) {
            wait = ahead;
        }
    }
    s->others_due_us = now + wait;
}

void scheduler_start(scheduler *s, const scheduler_rates *rates, uint32_t now)
{
    s->rates = rates;
    s->skipped = 0;
    s->others_due_us = now;
    for (uint8_t job = 0; job < SCHEDULER_JOBS; ++job) {
        s->armed[job] = rates->period_us[job] != 0u;
        s->due_us[job] = now + rates->phase_us[job];
    }
}

void scheduler_arm(scheduler *s, uint8_t job, uint32_t due_us)
{
    s->due_us[job] = due_us;
    s->armed[job] = true;
    if (job >= SCHEDULER_FREQUENT && !time_reached(due_us, s->others_due_us)) {
        s->others_due_us = due_us;
    }
}

void scheduler_disarm(scheduler *s, uint8_t job) { s->armed[job] = false; }

static void set_next_slot(scheduler *s, uint8_t job, uint32_t now)
{
    const uint32_t period = s->rates->period_us[job];
    if (period == 0u) {
        s->armed[job] = false;
        return;
    }
    s->due_us[job] += period;
    if (time_reached(now, s->due_us[job])) {
        const uint32_t missed = (uint32_t)(now - s->due_us[job]) / period + 1u;
        s->due_us[job] += missed * period;
        s->skipped = saturate_u16(s->skipped + missed);
    }
}

/* The first job from `first` on and below `end` that may start. `room_us` shrinks to the start of the next one that is still
 * ahead: whoever comes after it in importance has to end before. */
static uint8_t ready_of(scheduler *s, uint8_t first, uint8_t end, uint32_t now)
{
    for (uint8_t job = first; job < end; ++job) {
        if (!s->armed[job]) {
            continue;
        }
        const uint32_t late = now - s->due_us[job];
        if (late < AHEAD) {
            if (s->rates->cost_us[job] <= s->room_us || late > SCHEDULER_PATIENCE_US) {
                return job;
            }
        } else {
            const uint32_t ahead = s->due_us[job] - now;
            if (ahead < s->room_us) {
                s->room_us = ahead;
            }
        }
    }
    return SCHEDULER_NONE;
}

uint8_t scheduler_take(scheduler *s, uint32_t now)
{
    s->room_us = IDLE_US;
    uint8_t job = ready_of(s, 0, SCHEDULER_FREQUENT, now);
    if (job == SCHEDULER_NONE) {
        if (time_reached(now, s->others_due_us)) {
            job = ready_of(s, SCHEDULER_FREQUENT, SCHEDULER_JOBS, now);
            find_others_due(s, now);
        } else if (s->others_due_us - now < s->room_us) {
            s->room_us = s->others_due_us - now;
        } else {
            /* one of the frequent ones comes first */
        }
    }
    s->next_us = now + s->room_us;
    if (job != SCHEDULER_NONE) {
        set_next_slot(s, job, now);
    }
    return job;
}
