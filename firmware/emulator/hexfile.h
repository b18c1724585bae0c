/* Intel hex as gplink writes it: two bytes a word, little-endian; configuration words at 0x8007. */
#ifndef GSENSE_EMULATOR_HEXFILE_H
#define GSENSE_EMULATOR_HEXFILE_H

#include <stdbool.h>

#include "pic.h"

/* Loads flash and configuration. False: one line about file, line and fault is in `error`. */
bool hexfile_load(pic *p, const char *path, char *error, unsigned error_size);

#endif
