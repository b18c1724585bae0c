/* Which job runs now. Jobs are served in order of their number, which is their priority; none is interrupted.
 *
 * One table gives period, phase and cost. A job starts only where it ends before the next start of a more important one, so
 * that the MPU's slots stay on their grid; a job put off for longer than SCHEDULER_PATIENCE_US runs all the same. A job that
 * is late by a whole period skips the slots it missed (counted) and stays on its grid. Period 0: runs when armed.
 */
#ifndef GSENSE_SCHEDULER_H
#define GSENSE_SCHEDULER_H

#include <stdbool.h>
#include <stdint.h>

#define SCHEDULER_JOBS 11u
#define SCHEDULER_FREQUENT 4u /* jobs below it are looked at each time, the others only when the first of them is due */
#define SCHEDULER_NONE 0xFFu
#define SCHEDULER_PATIENCE_US 20000u

/* One entry a job; arrays of numbers, for an 8-bit CPU has no multiplication to index structures with. */
typedef struct {
    uint32_t period_us[SCHEDULER_JOBS];
    uint16_t phase_us[SCHEDULER_JOBS];
    uint16_t cost_us[SCHEDULER_JOBS]; /* longest run at 8 MIPS */
} scheduler_rates;

typedef struct {
    const scheduler_rates *rates;
    uint32_t due_us[SCHEDULER_JOBS];
    bool armed[SCHEDULER_JOBS];
    uint32_t room_us; /* free time ahead, while jobs are looked at */
    uint32_t next_us; /* the earliest time at which a job may start, where none could at the last look */
    uint32_t others_due_us; /* no job from SCHEDULER_FREQUENT on is due before */
    uint16_t skipped; /* slots missed, stays at 65535 */
} scheduler;

/* Arms all periodic jobs, first due at now + phase. */
void scheduler_start(scheduler *s, const scheduler_rates *rates, uint32_t now);
void scheduler_arm(scheduler *s, uint8_t job, uint32_t due_us);
void scheduler_disarm(scheduler *s, uint8_t job);

/* The job to run at `now`, its next slot already set, or SCHEDULER_NONE: then next_us tells when to ask again. */
uint8_t scheduler_take(scheduler *s, uint32_t now);

#endif
