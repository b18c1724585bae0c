/* Frames with their fields, made by the core, for the tests here and for the Python decoder's. */
#ifndef GSENSE_GOLDEN_H
#define GSENSE_GOLDEN_H

#include <stdio.h>

/* Writes the JSON document that is checked in as golden_frames.json. */
void golden_write(FILE *out);

#endif
