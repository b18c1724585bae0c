#include "options.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char HELP[] =
    "usage: gsense_board [options]\n"
    "Plays the board and the radio's receiver on a pseudo-terminal; its path is the first line on stdout.\n"
    "  --bus PATH            sensor bus file of the rig's simulation [/tmp/gsense-bus-<uid>-<ROS_DOMAIN_ID or 0>]\n"
    "  --no-bench            without a bus: failing reads, not a board lying on a table\n"
    "  --link PATH           symbolic link to the pseudo-terminal, removed at the end\n"
    "  --profile NAME        default (MPU 200 Hz, BNO 100 Hz) or fast (MPU 500 Hz, BNO 100 Hz)\n"
    "  --bno MODE            amg (raw data, default) or ndof (the chip's own fusion)\n"
    "  --seed N              of the noise without a bus [1]\n"
    "  --skew-ppm X          the board's clock is fast by X ppm [0], at most 1000\n"
    "  --start-us N          board time at power-on [0]: 4294000000 wraps within a second\n"
    "  --duration S          end after S seconds\n"
    "  --exit-with-parent    end when the process that started it ends\n";

enum { OPT_BUS = 1, OPT_NO_BENCH, OPT_LINK, OPT_PROFILE, OPT_BNO, OPT_SEED, OPT_SKEW, OPT_START, OPT_DURATION, OPT_PARENT,
       OPT_HELP };

static const struct option LONG_OPTIONS[] = {
    {"bus", required_argument, NULL, OPT_BUS},           {"no-bench", no_argument, NULL, OPT_NO_BENCH},
    {"link", required_argument, NULL, OPT_LINK},         {"profile", required_argument, NULL, OPT_PROFILE},
    {"bno", required_argument, NULL, OPT_BNO},           {"seed", required_argument, NULL, OPT_SEED},
    {"skew-ppm", required_argument, NULL, OPT_SKEW},     {"start-us", required_argument, NULL, OPT_START},
    {"duration", required_argument, NULL, OPT_DURATION}, {"exit-with-parent", no_argument, NULL, OPT_PARENT},
    {"help", no_argument, NULL, OPT_HELP},               {NULL, 0, NULL, 0}};

static bool get_number(const char *name, const char *text, double low, double high, double *value)
{
    char *end = NULL;
    errno = 0;
    *value = strtod(text, &end);
    if (errno == 0 && end != text && *end == '\0' && *value >= low && *value <= high) {
        return true;
    }
    fprintf(stderr, "gsense_board: --%s takes a number from %.0f to %.0f, not '%s'\n", name, low, high, text);
    return false;
}

static bool get_choice(const char *name, const char *text, const char *first, const char *second, bool *is_second)
{
    *is_second = strcmp(text, second) == 0;
    if (*is_second || strcmp(text, first) == 0) {
        return true;
    }
    fprintf(stderr, "gsense_board: --%s is %s or %s, not '%s'\n", name, first, second, text);
    return false;
}

static bool apply(options *o, int option, const char *text)
{
    double number = 0;
    bool second = false;
    bool good = true;
    switch (option) {
    case OPT_BUS: o->host.bus_path = text; break;
    case OPT_NO_BENCH: o->host.bench = false; break;
    case OPT_LINK: o->link = text; break;
    case OPT_PROFILE:
        good = get_choice("profile", text, "default", "fast", &second);
        o->profile = second ? &board_profile_fast : &board_profile_default;
        break;
    case OPT_BNO:
        good = get_choice("bno", text, "amg", "ndof", &second);
        o->bno_mode = second ? BNO_MODE_NDOF : BNO_MODE_AMG;
        break;
    case OPT_SEED:
        good = get_number("seed", text, 0, UINT32_MAX, &number);
        o->host.seed = good ? (uint32_t)number : 0;
        break;
    case OPT_SKEW: good = get_number("skew-ppm", text, -1000, 1000, &o->host.skew_ppm); break;
    case OPT_START:
        good = get_number("start-us", text, 0, UINT32_MAX, &number);
        o->host.start_us = good ? (uint32_t)number : 0;
        break;
    case OPT_DURATION: good = get_number("duration", text, 0, 1e9, &o->duration_s); break;
    case OPT_PARENT: o->exit_with_parent = true; break;
    default: good = false; break; /* getopt has said why */
    }
    return good;
}

static void set_defaults(options *o)
{
    memset(o, 0, sizeof *o);
    const char *domain = getenv("ROS_DOMAIN_ID");
    snprintf(o->default_bus, sizeof o->default_bus, "/tmp/gsense-bus-%lu-%s", (unsigned long)getuid(),
             domain != NULL && *domain != '\0' ? domain : "0");
    o->host.bus_path = o->default_bus;
    o->host.bench = true;
    o->host.seed = 1;
    o->profile = &board_profile_default;
    o->bno_mode = BNO_MODE_AMG;
}

options_result options_parse(int argc, char **argv, options *o)
{
    set_defaults(o);
    int option = 0;
    while ((option = getopt_long(argc, argv, "", LONG_OPTIONS, NULL)) != -1) {
        if (option == OPT_HELP) {
            fputs(HELP, stdout);
            return OPTIONS_EXIT;
        }
        if (!apply(o, option, optarg)) {
            return OPTIONS_WRONG;
        }
    }
    if (optind < argc) {
        fprintf(stderr, "gsense_board: '%s' is not an option (--help lists them)\n", argv[optind]);
        return OPTIONS_WRONG;
    }
    return OPTIONS_RUN;
}
