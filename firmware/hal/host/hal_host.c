#include <stdio.h>
#include <time.h>

#include "bench.h"
#include "config.h"
#include "counters.h"
#include "hal.h"
#include "host.h"

#define NS_PER_US 1000u
#define NS_PER_S 1000000000u
#define I2C_BYTE_NS 22500u      /* 9 bits at 400 kHz */
#define ADC_CONVERSION_NS 12000u
#define NAP_NS 500000u          /* between looks at a simulation that is behind */
#define LONGEST_SLEEP_NS 20000000u
#define BUS_POLL_NS 100000000u
#define OFF_NS 50000000u        /* without power in a brown-out */
#define WATCHDOG_NS 500000000u
#define HALF_CLOCK_NS 5000u
#define DRAIN_NS 400000000u         /* a reader that takes nothing for so long is none */
#define PATIENT_DRAIN_NS 5000000000u
#define SUSPENDED_NS 1000000000u /* further behind than this: the host slept */

host the_host;
volatile sig_atomic_t host_stop;

uint64_t host_now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

static void sleep_until(uint64_t time_ns)
{
    const struct timespec due = {(time_t)(time_ns / NS_PER_S), (long)(time_ns % NS_PER_S)};
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL); /* a signal ends it early: callers look again */
}

uint64_t host_time(uint64_t board_ns)
{
    const double skew = the_host.options.skew_ppm * 1e-6;
    return the_host.power_on_ns + board_ns - (uint64_t)(int64_t)((double)board_ns * skew / (1.0 + skew));
}

static void jump_if_suspended(uint64_t now_ns)
{
    const uint64_t shown = host_time(the_host.board_ns);
    if (now_ns > shown + SUSPENDED_NS) {
        fprintf(stderr, "gsense_board: %.1f s behind: clock set forward\n", (double)(now_ns - shown) * 1e-9);
        the_host.board_ns += now_ns - shown;
        the_host.kicked_ns = the_host.board_ns;
    }
}

static void poll_bus(uint64_t now_ns)
{
    if (now_ns < the_host.next_poll_ns) {
        return;
    }
    the_host.next_poll_ns = now_ns + BUS_POLL_NS;
    if (bus_poll(&the_host.bus, &the_host.registers, now_ns)) {
        fprintf(stderr, "gsense_board: reads the sensor bus %s\n", the_host.bus.path);
    }
}

void host_start(const host_options *options)
{
    the_host.options = *options;
    the_host.power_on_ns = host_now_ns();
    the_host.board_ns = 0;
    the_host.cause = RESET_POWER_ON;
    host_radio_start();
    the_host.bench_now = options->bench;
    chips_power_on(&the_host.registers, 0);
    bench_image(&the_host.registers, options->seed, 0, &the_host.image); /* the ADC works without any sensor */
    bus_init(&the_host.bus, options->bus_path);
    poll_bus(the_host.power_on_ns);
    if (the_host.bus.map == NULL) {
        fprintf(stderr, "gsense_board: no sensor bus at %s yet: %s\n", options->bus_path,
                options->bench ? "plays a board lying still on a table" : "reads fail until it appears");
    }
}

static void serve(uint64_t now_ns)
{
    pty_service(&the_host.pty, now_ns);
    poll_bus(now_ns);
}

static void reset_board(reset_cause cause)
{
    the_host.board_ns += OFF_NS;
    the_host.boot_ns = the_host.board_ns - the_host.board_ns % NS_PER_US;
    the_host.kicked_ns = the_host.board_ns;
    the_host.cause = cause;
    the_host.rebooted = true;
    if (cause == RESET_BROWN_OUT) { /* the chips lose their power as well */
        chips_power_on(&the_host.registers, the_host.board_ns);
        nrf_chip_reset(&the_host.air.sender);
    }
    line_restarted(&the_host.line);
    fprintf(stderr, "gsense_board: %s\n", cause == RESET_BROWN_OUT ? "brown-out" : "the watchdog struck");
}

bool host_take_reboot(void)
{
    const bool was = the_host.rebooted;
    the_host.rebooted = false;
    return was;
}

static void reset_if_due(void)
{
    const fault_options *faults = &the_host.options.faults;
    if (the_host.brownouts_done < faults->brownouts &&
        (double)the_host.board_ns >= faults->brownouts_s[the_host.brownouts_done] * 1e9) {
        ++the_host.brownouts_done;
        reset_board(RESET_BROWN_OUT);
    } else if (the_host.board_ns - the_host.kicked_ns > WATCHDOG_NS) {
        reset_board(RESET_WATCHDOG);
    }
}

void host_drain(bool patient)
{
    const uint64_t patience_ns = patient ? PATIENT_DRAIN_NS : DRAIN_NS;
    size_t left = pty_left(&the_host.pty);
    uint64_t changed_ns = host_now_ns();
    for (uint64_t now = changed_ns; left > 0 && now < changed_ns + patience_ns; now = host_now_ns()) {
        pty_service(&the_host.pty, now);
        const size_t still = pty_left(&the_host.pty);
        changed_ns = still != left ? now : changed_ns;
        left = still;
        sleep_until(now + NAP_NS);
    }
}

void host_run_until(uint32_t due_us)
{
    const uint32_t shown = hal_micros();
    if (!time_reached(shown, due_us)) {
        const uint64_t due_ns = the_host.board_ns - the_host.board_ns % NS_PER_US + (uint64_t)(due_us - shown) * NS_PER_US;
        host_radio_pass(due_ns);
        const uint64_t due_host = host_time(due_ns);
        uint64_t now = host_now_ns();
        while (now < due_host && !host_stop) {
            serve(now);
            uint64_t wake = due_host - now > LONGEST_SLEEP_NS ? now + LONGEST_SLEEP_NS : due_host;
            const uint64_t packet_due = pty_next_due(&the_host.pty);
            wake = packet_due > now && packet_due < wake ? packet_due : wake;
            sleep_until(wake);
            now = host_now_ns();
        }
        the_host.board_ns = due_ns;
    }
    host_radio_advance();
    const uint64_t now = host_now_ns();
    serve(now);
    jump_if_suspended(now);
    reset_if_due();
}

/* Waits, the board's clock standing still, until the simulation has passed the instant. */
static bool bus_image(uint64_t instant)
{
    for (;;) {
        const bus_answer answer = bus_image_at(&the_host.bus, instant, &the_host.image);
        if (answer != BUS_NOT_YET) {
            return answer == BUS_FOUND;
        }
        const uint64_t now = host_now_ns();
        if (host_stop || now > instant + BUS_SILENT_NS || bus_is_silent(&the_host.bus, now)) {
            return false;
        }
        pty_service(&the_host.pty, now);
        sleep_until(now + NAP_NS);
    }
}

/* The registers at the board's present instant into the_host.image; false: as from dead sensors. */
static bool look_at_sensors(void)
{
    const uint64_t instant = host_time(the_host.board_ns);
    if (the_host.bus.map != NULL && bus_image(instant)) {
        the_host.bench_now = false;
        return true;
    }
    if (the_host.bench_now) {
        bench_image(&the_host.registers, the_host.options.seed, instant - the_host.power_on_ns, &the_host.image);
    }
    return the_host.bench_now;
}

static void spend_transfer(uint8_t bytes) { the_host.board_ns += (uint64_t)bytes * I2C_BYTE_NS; }

uint32_t hal_micros(void)
{
    return the_host.options.start_us + (uint32_t)((the_host.board_ns - the_host.boot_ns) / NS_PER_US);
}

/* SDA low at AT for DURATION whatever the board does; with a DURATION of 0 until it is clocked free. */
static bool sda_is_low(void)
{
    const fault_window *fault = &the_host.options.faults.sda_low;
    if (fault->wanted && !the_host.sda_was_low && (double)the_host.board_ns >= fault->at_s * 1e9) {
        the_host.sda_was_low = true;
        the_host.sda_clocks_left = fault->duration_s > 0 ? 0 : 7;
    }
    return fault_window_holds(fault, the_host.board_ns) || the_host.sda_clocks_left > 0;
}

/* HAL_OK: the transfer may go on. */
static hal_status bus_fault(uint16_t deadline_us)
{
    if (sda_is_low()) {
        spend_transfer(1);
        return HAL_STUCK;
    }
    if (fault_window_holds(&the_host.options.faults.stretch, the_host.board_ns)) {
        the_host.board_ns += (uint64_t)deadline_us * NS_PER_US;
        return HAL_TIMEOUT;
    }
    return HAL_OK;
}

hal_status hal_i2c_read(uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, uint16_t deadline_us)
{
    const hal_status fault = bus_fault(deadline_us);
    if (fault != HAL_OK) {
        return fault;
    }
    if (!chips_answer(&the_host.registers, address, the_host.board_ns) || !look_at_sensors()) {
        spend_transfer(1);
        return HAL_NACK;
    }
    const bool good = chips_read(&the_host.registers, address, reg, data, length, &the_host.image);
    spend_transfer((uint8_t)(length + 3u)); /* address, register, address */
    return good ? HAL_OK : HAL_NACK;
}

hal_status hal_i2c_write(uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint16_t deadline_us)
{
    const hal_status fault = bus_fault(deadline_us);
    if (fault != HAL_OK) {
        return fault;
    }
    const bool dead = the_host.bench_now ? false : the_host.bus.map == NULL || bus_is_silent(&the_host.bus, host_now_ns());
    if (dead || !chips_write(&the_host.registers, address, reg, data, length, the_host.board_ns)) {
        spend_transfer(1);
        return HAL_NACK;
    }
    bus_write_registers(&the_host.bus, &the_host.registers);
    spend_transfer((uint8_t)(length + 2u));
    return HAL_OK;
}

bool hal_i2c_drive(bool scl, bool sda)
{
    the_host.board_ns += HALF_CLOCK_NS;
    if (scl && !the_host.scl && the_host.sda_clocks_left > 0) {
        --the_host.sda_clocks_left;
    }
    the_host.scl = scl;
    return sda && !sda_is_low();
}

void hal_i2c_restart(void) {}

void hal_adc_start(void) {}

static uint16_t convert(hal_adc_channel channel)
{
    the_host.board_ns += ADC_CONVERSION_NS;
    if (channel == HAL_ADC_BATTERY) {
        const uint32_t code = (the_host.image.battery_mv * 1024u + ADC_REFERENCE_MV) / (ADC_REFERENCE_MV * BATTERY_DIVIDER);
        return code > 1023u ? 1023u : (uint16_t)code;
    }
    the_host.lisy_index = (the_host.lisy_index + 1u) % IMAGE_LISY;
    return the_host.image.lisy[the_host.lisy_index] & 1023u;
}

uint16_t hal_adc_sum(hal_adc_channel channel)
{
    const uint8_t conversions = channel == HAL_ADC_LISY ? LISY_CONVERSIONS : 1u;
    uint16_t sum = 0;
    for (uint8_t i = 0; i < conversions; ++i) {
        sum = (uint16_t)(sum + convert(channel));
    }
    return sum;
}

void hal_watchdog_kick(void) { the_host.kicked_ns = the_host.board_ns; }

reset_cause hal_reset_cause(void) { return the_host.cause; }
