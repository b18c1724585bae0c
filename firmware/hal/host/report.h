/* What happened, as one JSON line: the injected faults as the line carried them, and the board's own counters. */
#ifndef GSENSE_REPORT_H
#define GSENSE_REPORT_H

#include "board.h"
#include "host.h"

/* To the file of --truth (written whole, then renamed), else to stderr. */
void report_truth(const host *h, const board *b);

#endif
