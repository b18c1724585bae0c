/* The radio's part of hal.h on the host: two emulated chips, and the receiver's program run whenever its chip got something. */
#include <string.h>

#include "hal.h"
#include "host.h"

#define SPI_BYTE_NS 8090u /* 33 bytes in 267 us, as measured at 8 MIPS */
#define POLL_NS 2000u
#define NS_PER_US 1000u

/* Board and receiver run one after the other in this process: whose pins are meant? */
static bool in_receiver;

static void run_receiver(void)
{
    in_receiver = true;
    receiver_step(&the_host.receiver);
    in_receiver = false;
}

void host_radio_start(void)
{
    air_init(&the_host.air, the_host.options.seed);
    line_init(&the_host.line, &the_host.options.faults, the_host.options.seed);
    in_receiver = true;
    receiver_init(&the_host.receiver, &radio_config);
    in_receiver = false;
}

void host_radio_advance(void)
{
    air *a = &the_host.air;
    const fault_options *faults = &the_host.options.faults;
    const bool random = the_host.board_ns >= FAULTS_FROM_NS;
    a->lose = random ? faults->lose : 0;
    a->repeat = random ? faults->repeat : 0;
    a->attempt = random ? faults->air_loss : 0;
    a->stuck = fault_window_holds(&faults->radio_stuck, the_host.board_ns);
    if (!the_host.radio_was_reset && faults->radio_reset.wanted &&
        (double)the_host.board_ns >= faults->radio_reset.at_s * 1e9) {
        the_host.radio_was_reset = true;
        nrf_chip_reset(&a->sender);
    }
    if (air_advance(a, the_host.board_ns)) {
        run_receiver();
    } else if (the_host.receiver.radio.state != NRF24_READY) {
        run_receiver(); /* its set-up */
    }
}

void host_radio_pass(uint64_t until_ns)
{
    const nrf_chip *sender = &the_host.air.sender;
    while (sender->in_flight && sender->tx_count > 1 && sender->done_ns <= until_ns) {
        the_host.board_ns = sender->done_ns > the_host.board_ns ? sender->done_ns : the_host.board_ns;
        host_radio_advance();
    }
}

static uint8_t transact(uint8_t command, const uint8_t *out, uint8_t *in, uint8_t length)
{
    if (in_receiver) { /* another processor: takes no time of the board's */
        return nrf_chip_spi(&the_host.air.receiver, the_host.board_ns, command, out, in, length);
    }
    the_host.board_ns += (1u + length) * (uint64_t)SPI_BYTE_NS;
    host_radio_advance();
    const uint8_t status = nrf_chip_spi(&the_host.air.sender, the_host.board_ns, command, out, in, length);
    host_radio_advance();
    return status;
}

uint8_t hal_radio_write(uint8_t command, const uint8_t *data, uint8_t length) { return transact(command, data, NULL, length); }

uint8_t hal_radio_read(uint8_t command, uint8_t *data, uint8_t length) { return transact(command, NULL, data, length); }

void hal_radio_ce(bool high)
{
    if (in_receiver) {
        the_host.air.receiver.ce = high;
        return;
    }
    the_host.air.sender.ce = high;
    host_radio_advance();
}

bool hal_radio_irq(void)
{
    if (in_receiver) {
        return nrf_chip_irq(&the_host.air.receiver);
    }
    the_host.board_ns += POLL_NS;
    host_radio_advance();
    return nrf_chip_irq(&the_host.air.sender);
}

/* When a packet may go out: at its frame's own board time, so that the pseudo-terminal adds no delay; with --real-delay
 * when the receiver has it. */
static uint64_t due_of(const uint8_t payload[NRF_PAYLOAD])
{
    if (the_host.options.faults.real_delay) {
        return host_time(the_host.air.heard_ns);
    }
    const uint32_t stamp = (uint32_t)payload[4] | (uint32_t)payload[5] << 8 | (uint32_t)payload[6] << 16 |
                           (uint32_t)payload[7] << 24;
    const uint64_t age_ns = (uint64_t)(uint32_t)(hal_micros() - stamp) * NS_PER_US;
    return host_time(the_host.board_ns - (age_ns < the_host.board_ns ? age_ns : 0));
}

uint8_t hal_serial_write(const uint8_t *data, uint8_t length)
{
    uint8_t payload[NRF_PAYLOAD + 1u];
    if (cobs_decode(data, length - 1u, payload) == NRF_PAYLOAD && !host_stop) { /* sensors may not have been waited for */
        line_send(&the_host.line, &the_host.pty, payload, data, length, due_of(payload), the_host.board_ns >= FAULTS_FROM_NS,
                  the_host.air.heard_twice);
        pty_service(&the_host.pty, host_now_ns());
    }
    return length;
}
