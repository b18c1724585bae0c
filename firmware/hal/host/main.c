#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

#include "board.h"
#include "host.h"
#include "options.h"
#include "report.h"

static void on_signal(int signal_number)
{
    (void)signal_number;
    host_stop = 1;
}

static volatile sig_atomic_t report_wanted;

static void on_request(int signal_number)
{
    (void)signal_number;
    report_wanted = 1;
}

static void catch_signals(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    action.sa_handler = on_request;
    sigaction(SIGUSR1, &action, NULL);
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL); /* whoever read stdout may have gone */
}

static void run(const options *o, board *b)
{
    const uint64_t end_ns = o->duration_s > 0 ? host_now_ns() + (uint64_t)(o->duration_s * 1e9) : UINT64_MAX;
    host_start(&o->host);
    board_init(b, o->profile, o->bno_mode);
    while (!host_stop && host_now_ns() < end_ns) {
        host_run_until(board_step(b));
        if (host_take_reboot()) {
            board_init(b, o->profile, o->bno_mode);
        }
        if (report_wanted) {
            report_wanted = 0;
            report_truth(&the_host, b);
        }
    }
}

int main(int argc, char **argv)
{
    const pid_t parent = getppid();
    options o;
    switch (options_parse(argc, argv, &o)) {
    case OPTIONS_EXIT: return 0;
    case OPTIONS_WRONG: return 2;
    case OPTIONS_RUN: break;
    }
    catch_signals();
    if (o.exit_with_parent) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (getppid() != parent) { /* it went before the line above */
            return 0;
        }
    }
    if (!pty_open(&the_host.pty, o.link)) {
        return 1;
    }
    printf("%s\n", the_host.pty.path);
    fflush(stdout);

    static board b;
    run(&o, &b);
    const bool truth_wanted = faults_any(&o.host.faults) || o.host.faults.truth_path != NULL;
    host_drain(truth_wanted);
    if (truth_wanted) {
        report_truth(&the_host, &b);
    }
    pty_close(&the_host.pty);
    bus_close(&the_host.bus);
    fprintf(stderr,
            "gsense_board: %" PRIu64 " frames, %" PRIu64 " dropped for want of a reader, %u slots skipped, %u I2C errors\n",
            the_host.air.frames, the_host.pty.dropped, b.slots.skipped, b.bus.errors);
    return 0;
}
