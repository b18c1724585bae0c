#include <string.h>

#include "board.h"
#include "cmocka_all.h"
#include "config.h"
#include "fake_hal.h"
#include "receiver.h"

#define FRAME_US 1667u /* 600 a second */
#define LINE_BYTES_PER_MS 46u /* 460800 baud */

static receiver r;
static nrf24 sender;
static unsigned next_number;

static void step_receiver(void)
{
    fake.in_receiver = true;
    receiver_step(&r);
    fake.in_receiver = false;
}

static int setup(void **state)
{
    (void)state;
    fake_reset();
    next_number = 0;
    fake.receiver_reads = false;
    fake.in_receiver = true;
    nrf_chip_reset(&fake.air.receiver);
    receiver_init(&r, &radio_config);
    fake.in_receiver = false;
    nrf24_init(&sender, &radio_config, NRF24_TRANSMITTER);
    while (r.radio.state != NRF24_READY || sender.state != NRF24_READY) {
        step_receiver();
        fake.time_us += nrf24_setup_step(&sender);
        fake.time_us += 1000;
    }
    return 0;
}

/* A frame whose bytes tell its number; no zero first, so that the packet is easy to read. */
static void send_next(void)
{
    uint8_t payload[NRF_PAYLOAD] = {1, (uint8_t)(next_number & 0xFF), (uint8_t)(next_number >> 8)};
    ++next_number;
    nrf24_finish(&sender);
    nrf24_send(&sender, payload);
}

/* Frames at 600 a second for `ms`, the line taking its bytes or, stalled, none. */
static void run(unsigned ms, bool stalled)
{
    const uint64_t end = fake.time_us + ms * 1000u;
    uint64_t due = fake.time_us;
    while (fake.time_us < end) {
        if (fake.time_us >= due) {
            send_next();
            due += FRAME_US;
        }
        const uint64_t before = fake.time_us;
        fake.time_us += 500;
        fake.serial_room = stalled ? 0 : (unsigned)((fake.time_us - before) * LINE_BYTES_PER_MS / 1000u + 1u);
        step_receiver();
    }
    nrf24_finish(&sender);
}

static unsigned count_packets_in_order(void)
{
    unsigned found = 0;
    unsigned begin = 0;
    for (unsigned i = 0; i < fake.serial_size; ++i) {
        if (fake.serial[i] == 0) {
            uint8_t data[64];
            assert_int_equal(cobs_decode(&fake.serial[begin], i - begin, data), NRF_PAYLOAD);
            assert_int_equal(data[1] | (unsigned)data[2] << 8, found);
            ++found;
            begin = i + 1;
        }
    }
    return found;
}

static void no_payload_is_lost_while_the_host_stalls_for_50_ms(void **state)
{
    (void)state;
    run(30, false);
    run(50, true);
    const unsigned waited = r.waiting;
    run(80, false);
    fake.serial_room = 4000;
    step_receiver();
    print_message("%u waited at the end of the stall, %u at most\n", waited, r.deepest);
    assert_in_range(waited, 28, 32); /* 600 / s * 50 ms */
    assert_int_equal(r.overflow, 0);
    assert_int_equal(sender.given_up, 0);
    assert_int_equal(r.waiting, 0);
    assert_int_equal(count_packets_in_order(), next_number);
}

static void a_longer_stall_loses_whole_payloads_and_counts_them(void **state)
{
    (void)state;
    run(100, true);
    assert_int_equal(r.waiting, RECEIVER_RING);
    assert_int_equal(r.overflow + r.waiting, next_number);
    fake.serial_room = 4000;
    step_receiver();
    assert_int_equal(count_packets_in_order(), RECEIVER_RING);
}

static void three_payloads_wait_in_the_chip(void **state)
{
    (void)state;
    for (int i = 0; i < 3; ++i) {
        send_next();
        nrf24_finish(&sender);
    }
    assert_int_equal(fake.air.receiver.rx_count, 3);
    send_next(); /* no room: not acknowledged */
    nrf24_finish(&sender);
    assert_int_equal(sender.given_up, 1);
    fake.serial_room = 4000;
    step_receiver();
    assert_int_equal(count_packets_in_order(), 3);
}

static void an_impossible_width_flushes_the_fifo(void **state)
{
    (void)state;
    const uint8_t widths[] = {0, 33, 200};
    for (unsigned i = 0; i < sizeof widths; ++i) {
        send_next();
        nrf24_finish(&sender);
        fake.air.receiver.rx[0].size = widths[i];
        step_receiver();
        assert_int_equal(fake.air.receiver.rx_count, 0);
        assert_int_equal(r.radio.bad_width, i + 1);
    }
    send_next();
    nrf24_finish(&sender);
    fake.air.receiver.rx[0].size = 7; /* another kind of sender: taken out, not passed on */
    step_receiver();
    assert_int_equal(r.radio.bad_width, 4);
    assert_int_equal(r.waiting, 0);
    assert_int_equal(fake.serial_size, 0);
}

static void a_repeated_payload_goes_out_twice(void **state)
{
    (void)state;
    fake.air.repeat = 1;
    send_next();
    nrf24_finish(&sender);
    fake.serial_room = 4000;
    step_receiver();
    assert_memory_equal(fake.serial, fake.serial + COBS_PACKET_SIZE(NRF_PAYLOAD), COBS_PACKET_SIZE(NRF_PAYLOAD));
    assert_int_equal(fake.serial_size, 2 * COBS_PACKET_SIZE(NRF_PAYLOAD));
}

static void an_unheard_acknowledgement_makes_no_second_payload(void **state)
{
    (void)state;
    fake.air.attempt = 0.5;
    for (int i = 0; i < 60; ++i) {
        send_next();
        nrf24_finish(&sender);
        fake.serial_room = 4000;
        step_receiver();
    }
    assert_true(fake.air.attempts > 80);
    unsigned packets = 0;
    for (unsigned i = 0; i < fake.serial_size; ++i) {
        packets += fake.serial[i] == 0 ? 1u : 0u;
    }
    assert_int_equal(packets, 60 - fake.air.undelivered);
}

static void a_radio_that_lost_its_registers_is_set_up_again(void **state)
{
    (void)state;
    nrf_chip_reset(&fake.air.receiver);
    fake.serial_room = 4000;
    for (int i = 0; i < 1300; ++i) {
        fake.time_us += 1000;
        step_receiver();
    }
    assert_int_equal(r.radio.restarts, 1);
    send_next();
    nrf24_finish(&sender);
    step_receiver();
    assert_int_equal(count_packets_in_order(), 1);
    assert_true(fake.kicks > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(no_payload_is_lost_while_the_host_stalls_for_50_ms, setup),
        cmocka_unit_test_setup(a_longer_stall_loses_whole_payloads_and_counts_them, setup),
        cmocka_unit_test_setup(three_payloads_wait_in_the_chip, setup),
        cmocka_unit_test_setup(an_impossible_width_flushes_the_fifo, setup),
        cmocka_unit_test_setup(a_repeated_payload_goes_out_twice, setup),
        cmocka_unit_test_setup(an_unheard_acknowledgement_makes_no_second_payload, setup),
        cmocka_unit_test_setup(a_radio_that_lost_its_registers_is_set_up_again, setup),
    };
    return cmocka_run_group_tests_name("receiver", tests, NULL, NULL);
}
