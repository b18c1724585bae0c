/* A board lying still on a table: what its sensors would show, without any simulation. */
#ifndef GSENSE_BENCH_H
#define GSENSE_BENCH_H

#include <stdint.h>

#include "chips.h"
#include "image.h"

/* The registers at `time_ns` after power-on, scaled by the chips' configuration; equal seeds give equal images. */
void bench_image(const chips *c, uint32_t seed, uint64_t time_ns, sensor_image *image);

#endif
