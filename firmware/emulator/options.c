#include "options.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char HELP[] =
    "usage: gsense_pic HEX [options]\n"
    "Runs the firmware's hex for the PIC16F15356 with emulated sensors and radio; prints the time budget.\n"
    "Exit 1: a slot too long, a frame missing, a register not modelled, a stack overflow. Exit 2: bad input.\n"
    "  --map FILE           gplink's map: slots by job, and with --profile time by function\n"
    "  --seconds S          emulated time (default 5)\n"
    "  --receiver           HEX is the receiver's: a distant board sends to it\n"
    "  --frames-per-s N     of that distant board (default 600)\n"
    "  --worst-us N         longest slot allowed (default 2000)\n"
    "  --slot NAME, --job NAME   functions that make a slot (default board_step, board_run_job)\n"
    "  --profile            time by function\n"
    "  --frames FILE        frames on the air: arrival in ns, 32 bytes in hex\n"
    "  --bursts FILE        what the sensors gave: start in ns, address, register, bytes in hex\n"
    "  --serial FILE        bytes of EUSART1\n"
    "  --trace AT:DURATION  every instruction on stderr: cycle, PC, W, STATUS, BSR, FSR0, FSR1\n"
    "  --json FILE          the report as JSON\n"
    "  --ppm X              the oscillator runs fast by so much\n"
    "  --seed N             of sensor noise and random faults\n"
    "Faults (s of true time since power-on):\n"
    "  --sda-low AT:DURATION (DURATION 0: until clocked free)   --stretch AT:DURATION   --bno-stretch-us N\n"
    "  --mpu-absent AT:DURATION   --brownout AT   --deaf AT:DURATION (MAX_RT)   --radio-stuck AT:DURATION\n"
    "  --radio-reset AT   --lose P   --air-loss P   --hang AT (the program, until the watchdog bites)\n";

#define LINE_DRAIN_S 0.1 /* the last frames have time to come out */

typedef enum { TEXT, NUMBER, PROBABILITY, WINDOW, INSTANT, INTEGER, SWITCH } kind;

typedef struct {
    const char *name;
    kind what;
    void *target;
    bool is_fault;
} option;

static bool number(const char *text, double *value)
{
    char *end = NULL;
    errno = 0;
    *value = strtod(text, &end);
    return errno == 0 && end != text && *end == '\0';
}

static bool window(const char *text, fault_window *w)
{
    char *colon = NULL;
    char *end = NULL;
    w->at_s = strtod(text, &colon);
    if (colon == text || *colon != ':') {
        return false;
    }
    w->duration_s = strtod(colon + 1, &end);
    w->wanted = true;
    return end != colon + 1 && *end == '\0' && w->at_s >= 0 && w->duration_s >= 0;
}

static bool set(const option *o, const char *text)
{
    double value = 0;
    switch (o->what) {
    case TEXT:
        *(const char **)o->target = text;
        return true;
    case WINDOW:
        return window(text, o->target);
    case INSTANT: {
        fault_window *w = o->target;
        w->wanted = number(text, &w->at_s) && w->at_s >= 0;
        return w->wanted;
    }
    case INTEGER:
        if (!number(text, &value) || value < 0 || value > 4294967295.0) {
            return false;
        }
        *(uint32_t *)o->target = (uint32_t)value;
        return true;
    case PROBABILITY:
        return number(text, o->target) && *(double *)o->target >= 0 && *(double *)o->target <= 1;
    case NUMBER:
    case SWITCH:
    default:
        return number(text, o->target);
    }
}

static options_outcome complain(const char *name, const char *text)
{
    (void)fprintf(stderr, "gsense_pic: %s does not take '%s'; see --help\n", name, text);
    return OPTIONS_BAD;
}

static options_outcome take(const option *table, size_t options, int count, char **arguments, int *at,
                            emulator_options *e)
{
    const char *name = arguments[*at];
    for (size_t i = 0; i < options; ++i) {
        if (strcmp(table[i].name, name) != 0) {
            continue;
        }
        e->faulty = e->faulty || table[i].is_fault;
        if (table[i].what == SWITCH) {
            *(bool *)table[i].target = true;
            return OPTIONS_RUN;
        }
        ++*at;
        const char *text = *at < count ? arguments[*at] : "";
        return set(&table[i], text) ? OPTIONS_RUN : complain(name, text);
    }
    (void)fprintf(stderr, "gsense_pic: unknown option %s; see --help\n", name);
    return OPTIONS_BAD;
}

static options_outcome parse(const option *table, size_t options, int count, char **arguments, emulator_options *e)
{
    for (int at = 1; at < count; ++at) {
        if (strcmp(arguments[at], "--help") == 0) {
            (void)fputs(HELP, stdout);
            return OPTIONS_HELP;
        }
        if (arguments[at][0] != '-' && e->hex == NULL) {
            e->hex = arguments[at];
        } else if (take(table, options, count, arguments, &at, e) != OPTIONS_RUN) {
            return OPTIONS_BAD;
        } else {
            /* taken */
        }
    }
    if (e->hex == NULL || e->seconds <= 0 || e->world.frames_per_s <= 0) {
        (void)fputs("gsense_pic: want a hex file, and --seconds and --frames-per-s above 0; see --help\n", stderr);
        return OPTIONS_BAD;
    }
    return OPTIONS_RUN;
}

options_outcome emulator_options_parse(int count, char **arguments, emulator_options *e)
{
    bool receiver = false;
    fault_window brownout = {false, 0, 0};
    fault_window hang = {false, 0, 0};
    memset(e, 0, sizeof *e);
    e->slot = "board_step";
    e->job = "board_run_job";
    e->seconds = 5;
    e->worst_us = 2000;
    e->world.frames_per_s = 600;
    world_options *w = &e->world;
    fault_options *f = &w->faults;
    const option table[] = {
        {"--map", TEXT, &e->map, false},
        {"--frames", TEXT, &e->frames_path, false},
        {"--bursts", TEXT, &e->bursts_path, false},
        {"--serial", TEXT, &e->serial_path, false},
        {"--json", TEXT, &e->json_path, false},
        {"--slot", TEXT, &e->slot, false},
        {"--job", TEXT, &e->job, false},
        {"--seconds", NUMBER, &e->seconds, false},
        {"--worst-us", NUMBER, &e->worst_us, false},
        {"--ppm", NUMBER, &e->ppm, false},
        {"--seed", INTEGER, &w->seed, false},
        {"--frames-per-s", NUMBER, &w->frames_per_s, false},
        {"--profile", SWITCH, &e->profile, false},
        {"--trace", WINDOW, &e->trace, false},
        {"--receiver", SWITCH, &receiver, false},
        {"--bno-stretch-us", NUMBER, &w->bno_stretch_us, false},
        {"--sda-low", WINDOW, &f->sda_low, true},
        {"--stretch", WINDOW, &f->stretch, true},
        {"--mpu-absent", WINDOW, &w->mpu_absent, true},
        {"--deaf", WINDOW, &w->deaf, true},
        {"--radio-stuck", WINDOW, &f->radio_stuck, true},
        {"--radio-reset", INSTANT, &f->radio_reset, true},
        {"--brownout", INSTANT, &brownout, true},
        {"--hang", INSTANT, &hang, true},
        {"--lose", PROBABILITY, &f->lose, true},
        {"--air-loss", PROBABILITY, &f->air_loss, true},
    };
    const options_outcome outcome = parse(table, sizeof table / sizeof table[0], count, arguments, e);
    e->world.role = receiver ? ROLE_RECEIVER : ROLE_BOARD;
    w->frames_until_s = e->seconds - LINE_DRAIN_S;
    e->brownout_s = brownout.wanted ? brownout.at_s : -1;
    e->hang_s = hang.wanted ? hang.at_s : -1;
    return outcome;
}
