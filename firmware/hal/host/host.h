/* The host in place of the chip: hal.h over emulated chips, a clock of its own, and the receiver on a pseudo-terminal.
 *
 * The board's clock stands still while the board waits for the simulation, and otherwise follows CLOCK_MONOTONIC: a slot
 * happens at its instant in board time even when the host is late, as on the chip, where a timer starts it. What is late is
 * the delivery. It is at most BUS_SILENT_NS behind; a host that was suspended jumps ahead and the scheduler skips slots.
 */
#ifndef GSENSE_HOST_H
#define GSENSE_HOST_H

#include <signal.h>
#include <stdbool.h>
#include <stdint.h>

#include "air.h"
#include "board.h"
#include "bus.h"
#include "chips.h"
#include "faults.h"
#include "hal.h"
#include "pty_link.h"
#include "receiver.h"

typedef struct {
    const char *bus_path;
    double skew_ppm;     /* the board's crystal against the host's clock */
    uint32_t start_us;   /* board time at power-on */
    uint32_t seed;       /* of the bench's noise */
    bool bench;          /* play a board on a table until a bus was seen */
    fault_options faults;
} host_options;

typedef struct {
    host_options options;
    uint64_t power_on_ns; /* CLOCK_MONOTONIC */
    uint64_t board_ns;    /* board clock since power-on */
    uint64_t boot_ns;     /* of it at the last start */
    uint64_t kicked_ns;   /* of it at the watchdog's last kick */
    reset_cause cause;
    bool rebooted; /* the program has to start over */
    unsigned brownouts_done;
    unsigned sda_clocks_left; /* until a chip lets go of SDA */
    bool sda_was_low;
    bool scl;
    uint64_t next_poll_ns;
    chips registers;
    sensor_bus bus;
    sensor_image image; /* of the last read; the ADC's conversions are taken from it as well */
    unsigned lisy_index;
    bool bench_now;
    pty_link pty;
    air air;
    receiver receiver;
    line line;
    bool radio_was_reset;
} host;

extern host the_host;
extern volatile sig_atomic_t host_stop;

/* Powers the chips on; the link is open already. */
void host_start(const host_options *options);
/* Sleeps until the board's clock shows `due_us`, serving link and bus; returns at once when that is past. */
void host_run_until(uint32_t due_us);
uint64_t host_now_ns(void);
/* The host's time at which the board's clock shows `board_ns`. */
uint64_t host_time(uint64_t board_ns);
/* Lets a reader take what is under way; `patient`: even one that a busy machine held up. */
void host_drain(bool patient);
/* True once after every reset of the board. */
bool host_take_reboot(void);

/* hal_radio.c */
void host_radio_start(void);
/* Brings the air up to the board's time. */
void host_radio_advance(void);
/* While the board sleeps until then: frames that wait in the chip go out. Moves the board's clock to their times. */
void host_radio_pass(uint64_t until_ns);

#endif
