#include <string.h>

#include "radio_on_bench.h"

static void set_up_takes_its_time_and_writes_every_register(void **state)
{
    (void)state;
    fake_reset();
    nrf24_init(&radio, &radio_config, NRF24_TRANSMITTER);
    assert_int_equal(nrf24_setup_step(&radio), 100000);
    assert_int_equal(nrf24_setup_step(&radio), NRF24_START_US);
    assert_int_equal(radio.state, NRF24_STARTING);
    assert_int_equal(nrf24_setup_step(&radio), 0);
    assert_int_equal(radio.state, NRF24_READY);
    const uint8_t *r = fake.air.sender.registers;
    assert_int_equal(r[NRF_CONFIG], 0x0E);
    assert_int_equal(r[NRF_EN_AA], 1);
    assert_int_equal(r[NRF_SETUP_RETR], RADIO_RETRIES); /* 250 us */
    assert_int_equal(r[NRF_RF_CH], RADIO_CHANNEL);
    assert_int_equal(r[NRF_RF_SETUP], 0x0E);
    assert_memory_equal(fake.air.sender.tx_address, radio_config.address, NRF_ADDRESS_BYTES);
    assert_memory_equal(fake.air.sender.rx_address, radio_config.address, NRF_ADDRESS_BYTES);
    assert_int_equal(fake.air.receiver.registers[NRF_CONFIG], 0x0F);
}

static void a_frame_takes_461_us(void **state)
{
    (void)state;
    const uint64_t us = send_and_wait();
    assert_in_range(us, 461, 600);
    assert_int_equal(fake.air.frames, 1);
    assert_int_equal(fake.air.undelivered, 0);
    assert_int_equal(radio.given_up, 0);
    assert_false(fake.air.sender.ce);
    assert_false(nrf_chip_irq(&fake.air.sender));
}

static void sending_does_not_wait(void **state)
{
    (void)state;
    const uint64_t before = fake.time_us;
    nrf24_send(&radio, payload);
    assert_true(fake.time_us - before < 300);
    assert_true(nrf24_busy(&radio));
    fake.time_us += 461;
    assert_false(nrf24_busy(&radio));
}

static void max_rt_is_flushed_counted_and_does_not_stop_the_next(void **state)
{
    (void)state;
    fake.air.lose = 1;
    assert_in_range(send_and_wait(), 1700, 2100);
    assert_int_equal(radio.given_up, 1);
    assert_int_equal(radio.retransmissions, RADIO_RETRIES);
    assert_int_equal(fake.air.sender.tx_count, 0);
    assert_int_equal(radio.state, NRF24_READY);
    fake.air.lose = 0;
    assert_in_range(send_and_wait(), 461, 600);
    assert_int_equal(radio.given_up, 1);
    assert_int_equal(radio.retransmissions, 0);
}

static void a_second_frame_waits_in_the_chip(void **state)
{
    (void)state;
    const uint64_t before = fake.time_us;
    nrf24_send(&radio, payload);
    nrf24_make_room(&radio);
    nrf24_send(&radio, payload);
    assert_true(fake.time_us - before < 600);
    assert_int_equal(radio.queued, 2);
    nrf24_send(&radio, payload); /* nobody made room */
    assert_int_equal(radio.given_up, 1);
    nrf24_make_room(&radio);
    assert_int_equal(radio.queued, 1);
    nrf24_finish(&radio);
    assert_int_equal(fake.air.frames, 2);
    assert_int_equal(fake.air.undelivered, 0);
    assert_int_equal(radio.given_up, 1);
    assert_false(fake.air.sender.ce);
}

static void max_rt_does_not_take_the_frame_behind_with_it(void **state)
{
    (void)state;
    fake.air.lose = 1;
    nrf24_send(&radio, payload);
    nrf24_send(&radio, payload);
    fake.air.lose = 0; /* the first is decided already */
    nrf24_finish(&radio);
    assert_int_equal(radio.given_up, 1);
    assert_int_equal(fake.air.frames, 2);
    assert_int_equal(fake.air.undelivered, 1);
    assert_int_equal(fake.air.sender.tx_count, 0);
}

static void two_frames_in_a_silent_chip_are_both_given_up(void **state)
{
    (void)state;
    fake.air.stuck = true;
    nrf24_send(&radio, payload);
    nrf24_send(&radio, payload);
    nrf24_finish(&radio);
    assert_int_equal(radio.given_up, 2);
    assert_int_equal(radio.queued, 0);
    set_up(&radio, &radio_config, NRF24_TRANSMITTER);
    nrf24_send(&radio, payload);
    nrf24_send(&radio, payload);
    fake.ignores_flush = true;
    nrf24_finish(&radio);
    assert_int_equal(radio.given_up, 2);
    assert_int_equal(radio.state, NRF24_CONFIGURE);
}

static void retries_are_reported(void **state)
{
    (void)state;
    fake.air.attempt = 0.4;
    unsigned retried = 0;
    for (int i = 0; i < 200; ++i) {
        const uint64_t us = send_and_wait();
        assert_true(us >= 460 + 414u * (radio.given_up == 0 ? radio.retransmissions : 0));
        retried += radio.retransmissions;
    }
    assert_int_equal(fake.air.attempts, 200 + retried);
    assert_in_range(radio.given_up, 5, 80); /* P(no ack in 4) = 0.64^4 = 0.17 */
    assert_true(fake.air.undelivered < radio.given_up);
}

static void power_down_and_up(void **state)
{
    (void)state;
    nrf24_power_down(&radio);
    assert_int_equal(fake.air.sender.registers[NRF_CONFIG] & NRF_CONFIG_PWR_UP, 0);
    assert_int_equal(nrf24_setup_step(&radio), 0);
    nrf24_send(&radio, payload);
    assert_int_equal(radio.given_up, 1);
    nrf24_power_up(&radio);
    fake.time_us += NRF24_START_US;
    assert_int_equal(nrf24_setup_step(&radio), 0);
    assert_in_range(send_and_wait(), 461, 600);
    assert_int_equal(fake.air.undelivered, 0);
}

static void clones_without_auto_ack(void **state)
{
    (void)state;
    nrf24_config clone = radio_config;
    clone.auto_ack = false;
    static nrf24 ear;
    fake.in_receiver = true;
    set_up(&ear, &clone, NRF24_RECEIVER);
    fake.in_receiver = false;
    set_up(&radio, &clone, NRF24_TRANSMITTER);
    fake.receiver_reads = false;
    assert_in_range(send_and_wait(), 290, 400); /* no acknowledgement to wait for */
    fake.in_receiver = true;
    uint8_t got[NRF_PAYLOAD];
    assert_int_equal(nrf24_receive(&ear, got), NRF24_PAYLOAD);
    assert_memory_equal(got, payload, NRF_PAYLOAD);
    fake.in_receiver = false;
    fake.air.lose = 1;
    (void)send_and_wait();
    assert_int_equal(fake.air.undelivered, 1);
    assert_int_equal(radio.given_up, 0); /* nobody can know */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(set_up_takes_its_time_and_writes_every_register, setup),
        cmocka_unit_test_setup(a_frame_takes_461_us, setup),
        cmocka_unit_test_setup(sending_does_not_wait, setup),
        cmocka_unit_test_setup(max_rt_is_flushed_counted_and_does_not_stop_the_next, setup),
        cmocka_unit_test_setup(a_second_frame_waits_in_the_chip, setup),
        cmocka_unit_test_setup(max_rt_does_not_take_the_frame_behind_with_it, setup),
        cmocka_unit_test_setup(two_frames_in_a_silent_chip_are_both_given_up, setup),
        cmocka_unit_test_setup(retries_are_reported, setup),
        cmocka_unit_test_setup(power_down_and_up, setup),
        cmocka_unit_test_setup(clones_without_auto_ack, setup),
    };
    return cmocka_run_group_tests_name("nrf24", tests, NULL, NULL);
}
