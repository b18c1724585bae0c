/* Follows the program's calls: time by function, and by slot.
 *
 * A slot is one call of the function `slot` in which the function `job` was called; the first call that `job` makes
 * gives the slot its name. Interrupts count in the slot they fall into. */
#ifndef GSENSE_EMULATOR_WATCH_H
#define GSENSE_EMULATOR_WATCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pic.h"
#include "symbols.h"

#define WATCH_DEPTH 17u

typedef struct {
    uint64_t calls;
    uint64_t own;   /* cycles without what it called */
    uint64_t whole; /* with */
    uint64_t longest;
} function_time;

typedef struct {
    uint64_t count;
    uint64_t cycles;
    uint64_t longest;
    uint64_t longest_ns; /* when it began */
} slot_time;

typedef struct {
    pic *chip;
    const symbol_table *table;
    size_t slot; /* index of the function, table->count: none */
    size_t job;
    size_t depth;
    struct {
        size_t function; /* table->count: unknown */
        uint64_t entered;
    } stack[WATCH_DEPTH + 1u];
    uint64_t since;
    /* the slot under way */
    size_t slot_depth; /* 0: none */
    size_t job_depth;
    size_t slot_job; /* function, table->count: not known yet */
    uint64_t slot_from;
    bool slot_runs;
    function_time functions[SYMBOLS_MOST + 1u];
    slot_time slots[SYMBOLS_MOST + 1u]; /* by job */
    slot_time all;
    uint64_t busy; /* cycles in slots, and in interrupts outside of them */
    uint64_t interrupts;
} watch;

/* The names have to be in the table. */
bool watch_start(watch *w, pic *chip, const symbol_table *table, const char *slot, const char *job);

#endif
