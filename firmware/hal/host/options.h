/* The command line of gsense_board. */
#ifndef GSENSE_OPTIONS_H
#define GSENSE_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"
#include "host.h"

#define OPTIONS_PATH_SIZE 256

typedef struct {
    host_options host;
    const char *link; /* symbolic link to the pseudo-terminal, or NULL */
    const board_profile *profile;
    uint8_t bno_mode;
    double duration_s; /* 0: until it is told to stop */
    bool exit_with_parent;
    char default_bus[OPTIONS_PATH_SIZE];
} options;

typedef enum { OPTIONS_RUN, OPTIONS_EXIT, OPTIONS_WRONG } options_result;

/* Help goes to stdout, one line on what is wrong to stderr. */
options_result options_parse(int argc, char **argv, options *o);

#endif
