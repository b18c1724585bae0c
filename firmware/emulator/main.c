/* gsense_pic: runs the hex of the PIC16F15356 and reports its time budget. */
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

static double now_s(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

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

static void run(everything *e, const emulator_options *o)
{
    pic *p = &e->chip;
    p->ppm = o->ppm;
    pic_reset(p, RESET_BY_POWER);
    const uint64_t end = (uint64_t)(o->seconds * NS_PER_S);
    const uint64_t brownout = (uint64_t)(o->brownout_s * NS_PER_S);
    if (o->brownout_s >= 0 && brownout < end) {
        while (pic_ns(p) < brownout) {
            pic_run(p, pic_cycles_at(p, brownout));
        }
        pic_reset(p, RESET_BY_BROWN_OUT);
    }
    while (pic_ns(p) < end) { /* again where the oscillator changed in between */
        pic_run(p, pic_cycles_at(p, end));
    }
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
        run_report report = {&options, &e->chip,      options.map == NULL ? NULL : &e->times, &e->world, {0},
                             0,        e->chip.cycles};
        report.speed = options.seconds / (now_s() - begin);
        tally_count(&report.frames, &e->world.frames);
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
