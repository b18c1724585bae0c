/* The command line of gsense_pic. */
#ifndef GSENSE_EMULATOR_OPTIONS_H
#define GSENSE_EMULATOR_OPTIONS_H

#include <stdbool.h>

#include "world.h"

typedef struct {
    const char *hex;
    const char *map;
    const char *frames_path; /* "ns hex" lines */
    const char *bursts_path; /* "ns address register hex" lines */
    const char *serial_path; /* raw bytes */
    const char *json_path;
    const char *slot;
    const char *job;
    double seconds;
    double worst_us; /* a slot as long as this fails */
    double ppm;
    double brownout_s;  /* < 0: none */
    double hang_s;      /* the same */
    fault_window trace; /* every instruction on stderr */
    bool profile;
    bool faulty; /* faults were asked for: lost frames are no failure */
    world_options world;
} emulator_options;

typedef enum { OPTIONS_RUN, OPTIONS_HELP, OPTIONS_BAD } options_outcome;

options_outcome emulator_options_parse(int count, char **arguments, emulator_options *options);

#endif
