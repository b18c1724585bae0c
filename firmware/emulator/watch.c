#include "watch.h"

#include <string.h>

#define INTERRUPT_VECTOR 4u

static void charge(watch *w)
{
    w->functions[w->stack[w->depth].function].own += w->chip->cycles - w->since;
    w->since = w->chip->cycles;
}

static void start_over(watch *w)
{
    w->depth = 0;
    w->stack[0].function = w->table->count;
    w->stack[0].entered = w->chip->cycles;
    w->slot_depth = 0;
}

static void on_call(void *context, uint16_t target)
{
    watch *w = context;
    charge(w);
    if (target == 0) { /* a reset */
        start_over(w);
        return;
    }
    const size_t function = symbols_at(w->table, target);
    if (w->depth < WATCH_DEPTH) {
        ++w->depth;
    }
    w->stack[w->depth].function = function;
    w->stack[w->depth].entered = w->chip->cycles;
    if (target == INTERRUPT_VECTOR) {
        ++w->interrupts;
    }
    ++w->functions[function].calls;
    if (function == w->slot && w->slot_depth == 0) {
        w->slot_depth = w->depth;
        w->slot_from = w->chip->cycles;
        w->slot_runs = false;
        w->slot_job = w->table->count;
    } else if (function == w->job && w->slot_depth != 0) {
        w->slot_runs = true;
        w->job_depth = w->depth;
    } else if (w->slot_runs && w->slot_job == w->table->count && w->depth == w->job_depth + 1u &&
               target != INTERRUPT_VECTOR) {
        w->slot_job = function;
    } else {
        /* any other */
    }
}

static void add(slot_time *s, uint64_t cycles, uint64_t from_ns)
{
    ++s->count;
    s->cycles += cycles;
    if (cycles > s->longest) {
        s->longest = cycles;
        s->longest_ns = from_ns;
    }
}

static void end_slot(watch *w)
{
    const uint64_t cycles = w->chip->cycles - w->slot_from;
    if (w->slot_runs) {
        const uint64_t from_ns = pic_ns(w->chip) - cycles * w->chip->cycle_ns;
        add(&w->slots[w->slot_job], cycles, from_ns);
        add(&w->all, cycles, from_ns);
        w->busy += cycles;
    }
    w->slot_depth = 0;
}

static void on_leave(void *context)
{
    watch *w = context;
    charge(w);
    if (w->depth == 0) {
        return;
    }
    function_time *f = &w->functions[w->stack[w->depth].function];
    const uint64_t took = w->chip->cycles - w->stack[w->depth].entered;
    f->whole += took;
    f->longest = took > f->longest ? took : f->longest;
    if (w->depth == w->slot_depth) {
        end_slot(w);
    } else if (w->slot_depth == 0 && w->stack[w->depth].function == symbols_at(w->table, INTERRUPT_VECTOR)) {
        w->busy += took;
    } else {
        /* inside of a slot, or idle */
    }
    --w->depth;
}

bool watch_start(watch *w, pic *chip, const symbol_table *table, const char *slot, const char *job)
{
    memset(w, 0, sizeof *w);
    w->chip = chip;
    w->table = table;
    w->slot = symbols_find(table, slot);
    w->job = symbols_find(table, job);
    start_over(w);
    chip->watch.call = on_call;
    chip->watch.leave = on_leave;
    chip->watch.context = w;
    return w->slot != table->count && w->job != table->count;
}
