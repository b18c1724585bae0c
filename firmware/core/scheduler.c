#include "scheduler.h"

#include "counters.h"

#define IDLE_US 1000000u /* nothing armed: look again after this */

void scheduler_start(scheduler *s, const scheduler_rates *rates, uint32_t now)
{
    s->rates = rates;
    s->skipped = 0;
    for (uint8_t job = 0; job < SCHEDULER_JOBS; ++job) {
        s->armed[job] = rates->period_us[job] != 0u;
        s->due_us[job] = now + rates->phase_us[job];
    }
}

void scheduler_arm(scheduler *s, uint8_t job, uint32_t due_us)
{
    s->due_us[job] = due_us;
    s->armed[job] = true;
}

void scheduler_disarm(scheduler *s, uint8_t job) { s->armed[job] = false; }

/* A more important job that is already due would have been taken before, so all of these lie ahead. */
static bool fits(const scheduler *s, uint8_t job, uint32_t now)
{
    if ((uint32_t)(now - s->due_us[job]) > SCHEDULER_PATIENCE_US) {
        return true;
    }
    for (uint8_t other = 0; other < job; ++other) {
        if (s->armed[other] && (uint32_t)(s->due_us[other] - now) < s->rates->cost_us[job]) {
            return false;
        }
    }
    return true;
}

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

uint8_t scheduler_take(scheduler *s, uint32_t now)
{
    for (uint8_t job = 0; job < SCHEDULER_JOBS; ++job) {
        if (s->armed[job] && time_reached(now, s->due_us[job]) && fits(s, job, now)) {
            set_next_slot(s, job, now);
            return job;
        }
    }
    return SCHEDULER_NONE;
}

uint32_t scheduler_next(const scheduler *s, uint32_t now)
{
    uint32_t wait = IDLE_US;
    for (uint8_t job = 0; job < SCHEDULER_JOBS; ++job) {
        if (!s->armed[job]) {
            continue;
        }
        if (!time_reached(now, s->due_us[job])) {
            const uint32_t ahead = s->due_us[job] - now;
            if (ahead < wait) {
                wait = ahead;
            }
        } else if (fits(s, job, now)) {
            return now;
        } else {
            /* put off: it may start after the job that is in its way, whose own start is in this minimum */
        }
    }
    return now + wait;
}
