/* gsense_pic: runs the hex of the PIC16F15356 and reports its time budget. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "hexfile.h"
#include "options.h"
#include "report.h"

#define EXIT_BAD_INPUT 2
#define ERROR_SIZE 300u
#define NS_PER_S 1e9

typedef struct {
    pic chip;
    struct outside world;
    symbol_table symbols;
    watch times;
} everything;

/* Of this process, so that a busy machine does not count. */
static double now_s(void) { return (double)clock() / CLOCKS_PER_SEC; }

static bool load(everything *e, const emulator_options *o, char *error)
{
    if (!hexfile_load(&e->chip, o->hex, error, ERROR_SIZE)) {
        return false;
    }
    pic_program(&e->chip);
    if (o->map == NULL) {
        return true;
    }
    if (!symbols_load(&e->symbols, o->map, error, ERROR_SIZE)) {
        return false;
    }
    const bool found = watch_start(&e->times, &e->chip, &e->symbols, o->slot, o->job);
    if (!found && o->world.role == ROLE_BOARD) {
        (void)snprintf(error, ERROR_SIZE, "%s: no functions %s and %s in it; name them with --slot and --job", o->map,
                       o->slot, o->job);
    }
    return found || o->world.role == ROLE_RECEIVER;
}

static void run_until(pic *p, uint64_t ns)
{
    while (pic_ns(p) < ns) { /* again where the oscillator changed in between */
        pic_run(p, pic_cycles_at(p, ns));
    }
}

static void trace(everything *e, uint64_t until_ns)
{
    pic *p = &e->chip;
    while (pic_ns(p) < until_ns) {
        const size_t at = symbols_at(&e->symbols, p->pc);
        (void)fprintf(stderr, "%" PRIu64 " %04x %02x %02x %02x %04x %04x %s\n", p->cycles, p->pc, p->w, p->status,
                      p->bsr, p->fsr[0], p->fsr[1], at < e->symbols.count ? e->symbols.items[at].name : "");
        pic_step(p);
    }
}

static void run(everything *e, const emulator_options *o)
{
    pic *p = &e->chip;
    p->ppm = o->ppm;
    pic_reset(p, RESET_BY_POWER);
    const uint64_t end = (uint64_t)(o->seconds * NS_PER_S);
    if (o->trace.wanted) {
        run_until(p, (uint64_t)(o->trace.at_s * NS_PER_S));
        trace(e, (uint64_t)((o->trace.at_s + o->trace.duration_s) * NS_PER_S));
    }
    if (o->brownout_s >= 0 && o->brownout_s < o->seconds) {
        run_until(p, (uint64_t)(o->brownout_s * NS_PER_S));
        pic_reset(p, RESET_BY_BROWN_OUT);
    }
    if (o->hang_s >= 0 && o->hang_s < o->seconds) {
        run_until(p, (uint64_t)(o->hang_s * NS_PER_S));
        pic_hang(p);
    }
    run_until(p, end);
}

int main(int count, char **arguments)
{
    emulator_options options;
    const options_outcome outcome = emulator_options_parse(count, arguments, &options);
    if (outcome != OPTIONS_RUN) {
        return outcome == OPTIONS_HELP ? EXIT_SUCCESS : EXIT_BAD_INPUT;
    }
    everything *e = calloc(1, sizeof *e);
    if (e == NULL) {
        (void)fputs("gsense_pic: out of memory\n", stderr);
        return EXIT_BAD_INPUT;
    }
    char error[ERROR_SIZE];
    int code = EXIT_BAD_INPUT;
    world_init(&e->world, &options.world);
    pic_init(&e->chip, &e->world);
    if (load(e, &options, error)) {
        const double begin = now_s();
        run(e, &options);
        run_report report;
        memset(&report, 0, sizeof report);
        report.options = &options;
        report.chip = &e->chip;
        report.times = options.map == NULL ? NULL : &e->times;
        report.world = &e->world;
        report.cycles = e->chip.cycles;
        report.speed = options.seconds / (now_s() - begin);
        tally_count(&report.frames, &e->world.frames);
        tally_line(&report.line, &e->world.frames, &e->world.serial);
        report_print(&report);
        code = !report_write_files(&report)    ? EXIT_BAD_INPUT
               : report_fault(&report) == NULL ? EXIT_SUCCESS
                                               : EXIT_FAILURE;
    } else {
        (void)fprintf(stderr, "gsense_pic: %s\n", error);
    }
    world_free(&e->world);
    free(e);
    return code;
}
