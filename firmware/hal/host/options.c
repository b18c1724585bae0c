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
    "  --real-delay          SPI, air and UART take their time [a packet comes at its frame's board time]\n"
    "  --start-us N          board time at power-on [0]: 4294000000 wraps within a second\n"
    "  --duration S          end after S seconds\n"
    "  --exit-with-parent    end when the process that started it ends\n"
    "Faults (random ones from the first second on, the same for the same seed; AT and DURATION in s after power-on):\n"
    "  --lose P              probability that a frame is lost with all its retries\n"
    "  --air-loss P          that a packet on the air, or its acknowledgement, is not heard\n"
    "  --repeat P            that the receiver delivers a frame twice\n"
    "  --flip P              that one bit of a packet on the serial line is flipped\n"
    "  --latency-bursts MS   packets leave in bursts, up to MS apart (USB adapters: 16)\n"
    "  --sda-low AT:DURATION SDA held low; DURATION 0: until it is clocked free\n"
    "  --stretch AT:DURATION I2C clock stretched past every deadline\n"
    "  --brownout AT         the board loses its power for 50 ms (up to 8 times)\n"
    "  --radio-stuck AT:DURATION  the transmitter's chip sends nothing and says nothing\n"
    "  --radio-reset AT      the transmitter's chip alone loses its registers\n"
    "  --truth FILE          what the line really carried, as JSON, at the end and upon SIGUSR1 [stderr]\n";

enum { OPT_BUS = 1, OPT_NO_BENCH, OPT_LINK, OPT_PROFILE, OPT_BNO, OPT_SEED, OPT_SKEW, OPT_START, OPT_DURATION, OPT_PARENT,
       OPT_HELP, OPT_REAL_DELAY, OPT_LOSE, OPT_AIR_LOSS, OPT_REPEAT, OPT_FLIP, OPT_BURSTS, OPT_SDA_LOW, OPT_STRETCH,
       OPT_BROWNOUT, OPT_RADIO_STUCK, OPT_RADIO_RESET, OPT_TRUTH };

static const struct option LONG_OPTIONS[] = {
    {"bus", required_argument, NULL, OPT_BUS},           {"no-bench", no_argument, NULL, OPT_NO_BENCH},
    {"link", required_argument, NULL, OPT_LINK},         {"profile", required_argument, NULL, OPT_PROFILE},
    {"bno", required_argument, NULL, OPT_BNO},           {"seed", required_argument, NULL, OPT_SEED},
    {"skew-ppm", required_argument, NULL, OPT_SKEW},     {"start-us", required_argument, NULL, OPT_START},
    {"duration", required_argument, NULL, OPT_DURATION}, {"exit-with-parent", no_argument, NULL, OPT_PARENT},
    {"help", no_argument, NULL, OPT_HELP},               {"real-delay", no_argument, NULL, OPT_REAL_DELAY},
    {"lose", required_argument, NULL, OPT_LOSE},         {"air-loss", required_argument, NULL, OPT_AIR_LOSS},
    {"repeat", required_argument, NULL, OPT_REPEAT},     {"flip", required_argument, NULL, OPT_FLIP},
    {"latency-bursts", required_argument, NULL, OPT_BURSTS}, {"sda-low", required_argument, NULL, OPT_SDA_LOW},
    {"stretch", required_argument, NULL, OPT_STRETCH},   {"brownout", required_argument, NULL, OPT_BROWNOUT},
    {"radio-stuck", required_argument, NULL, OPT_RADIO_STUCK}, {"radio-reset", required_argument, NULL, OPT_RADIO_RESET},
    {"truth", required_argument, NULL, OPT_TRUTH},       {NULL, 0, NULL, 0}};

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

static bool get_window(const char *name, const char *text, bool lasts, fault_window *window)
{
    char *end = NULL;
    window->wanted = true;
    window->at_s = strtod(text, &end);
    bool good = end != text && window->at_s >= 0;
    if (lasts && good && *end == ':') {
        const char *rest = end + 1;
        window->duration_s = strtod(rest, &end);
        good = end != rest && window->duration_s >= 0;
    } else {
        good = good && !lasts;
    }
    if (!good || *end != '\0') {
        fprintf(stderr, "gsense_board: --%s takes %s in seconds, not '%s'\n", name, lasts ? "AT:DURATION" : "AT", text);
        return false;
    }
    return true;
}

static bool add_brownout(fault_options *faults, const char *text)
{
    fault_window at;
    if (!get_window("brownout", text, false, &at)) {
        return false;
    }
    const double before = faults->brownouts > 0 ? faults->brownouts_s[faults->brownouts - 1] : -1;
    if (faults->brownouts == FAULT_BROWNOUTS || at.at_s <= before) {
        fprintf(stderr, "gsense_board: --brownout comes at most %u times, in order of time\n", FAULT_BROWNOUTS);
        return false;
    }
    faults->brownouts_s[faults->brownouts++] = at.at_s;
    return true;
}

static bool apply_fault(fault_options *faults, int option, const char *text)
{
    switch (option) {
    case OPT_REAL_DELAY: faults->real_delay = true; return true;
    case OPT_LOSE: return get_number("lose", text, 0, 1, &faults->lose);
    case OPT_AIR_LOSS: return get_number("air-loss", text, 0, 1, &faults->air_loss);
    case OPT_REPEAT: return get_number("repeat", text, 0, 1, &faults->repeat);
    case OPT_FLIP: return get_number("flip", text, 0, 1, &faults->flip);
    case OPT_BURSTS: return get_number("latency-bursts", text, 0, 1000, &faults->latency_ms);
    case OPT_SDA_LOW: return get_window("sda-low", text, true, &faults->sda_low);
    case OPT_STRETCH: return get_window("stretch", text, true, &faults->stretch);
    case OPT_RADIO_STUCK: return get_window("radio-stuck", text, true, &faults->radio_stuck);
    case OPT_RADIO_RESET: return get_window("radio-reset", text, false, &faults->radio_reset);
    case OPT_BROWNOUT: return add_brownout(faults, text);
    case OPT_TRUTH: faults->truth_path = text; return true;
    default: return false; /* getopt has said why */
    }
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
    default: good = apply_fault(&o->host.faults, option, text); break;
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
