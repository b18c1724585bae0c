/* The program proper, apart from the chip's main: what pic/specialise.py takes as its root. */
#ifndef GSENSE_PROGRAM_H
#define GSENSE_PROGRAM_H

void program_run(void);

#endif
