/* What the run showed, as text and as JSON, and whether it is good. */
#ifndef GSENSE_EMULATOR_REPORT_H
#define GSENSE_EMULATOR_REPORT_H

#include <stdbool.h>

#include "options.h"
#include "tally.h"
#include "watch.h"
#include "world.h"

typedef struct {
    const emulator_options *options;
    const pic *chip;
    const watch *times; /* NULL without a map */
    const struct outside *world;
    tally frames;
    line_tally line;
    double speed; /* emulated time against the host's */
    uint64_t cycles;
} run_report;

/* NULL, or the first thing that is not as it should be, in words. */
const char *report_fault(const run_report *r);
void report_print(const run_report *r);
/* False: a file could not be written; stderr tells which. */
bool report_write_files(const run_report *r);

#endif
