#include "radio_on_bench.h"

static void a_fifo_that_keeps_its_payload_after_max_rt_sets_the_chip_up(void **state)
{
    (void)state;
    fake.air.lose = 1;
    fake.ignores_flush = true;
    (void)send_and_wait();
    assert_int_equal(radio.stuck, 1);
    assert_int_equal(radio.restarts, 1);
    assert_int_equal(radio.state, NRF24_CONFIGURE);
    fake.ignores_flush = false;
    fake.air.lose = 0;
    while (radio.state != NRF24_READY) {
        fake.time_us += nrf24_setup_step(&radio);
    }
    (void)send_and_wait();
    assert_int_equal(fake.air.sender.tx_count, 0);
    assert_int_equal(radio.given_up, 1);
}

static void a_silent_chip_costs_a_bounded_wait_and_then_a_set_up(void **state)
{
    (void)state;
    fake.air.stuck = true;
    assert_in_range(send_and_wait(), RADIO_TIMEOUT_US, RADIO_TIMEOUT_US + 500);
    assert_int_equal(radio.state, NRF24_READY);
    (void)send_and_wait();
    assert_int_equal(radio.stuck, 2);
    assert_int_equal(radio.given_up, 2);
    assert_int_equal(radio.state, NRF24_CONFIGURE);
    (void)send_and_wait(); /* while it is set up: given up at once */
    assert_int_equal(radio.given_up, 3);
}

static void the_wait_ends_even_without_a_timer(void **state)
{
    (void)state;
    fake.air.stuck = true;
    fake.frozen = true;
    nrf24_send(&radio, payload);
    nrf24_finish(&radio);
    assert_int_equal(radio.queued, 0);
    assert_int_equal(radio.stuck, 1);
}

static void an_irq_line_that_is_low_for_no_reason_is_a_stuck_chip(void **state)
{
    (void)state;
    fake.irq_low = true;
    nrf24_send(&radio, payload);
    assert_false(nrf24_busy(&radio));
    assert_int_equal(radio.stuck, 1);
}

static void lost_registers_are_seen(void **state)
{
    (void)state;
    assert_true(nrf24_verify(&radio));
    nrf_chip_reset(&fake.air.sender);
    assert_false(nrf24_verify(&radio));
    assert_int_equal(radio.restarts, 1);
    while (radio.state != NRF24_READY) {
        fake.time_us += nrf24_setup_step(&radio);
    }
    assert_true(nrf24_verify(&radio));
    (void)send_and_wait();
    assert_int_equal(radio.given_up, 0);
    nrf24_send(&radio, payload);
    assert_true(nrf24_verify(&radio)); /* not while sending */
}

static void a_dead_chip_is_tried_again(void **state)
{
    (void)state;
    fake.radio_dead = true;
    set_up(&radio, &radio_config, NRF24_TRANSMITTER);
    assert_int_equal(radio.state, NRF24_CONFIGURE);
    assert_int_equal(nrf24_setup_step(&radio), SETUP_RETRY_US);
    assert_false(nrf24_verify(&radio));
    fake.radio_dead = false;
    assert_int_equal(nrf24_setup_step(&radio), NRF24_START_US);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_fifo_that_keeps_its_payload_after_max_rt_sets_the_chip_up, setup),
        cmocka_unit_test_setup(a_silent_chip_costs_a_bounded_wait_and_then_a_set_up, setup),
        cmocka_unit_test_setup(the_wait_ends_even_without_a_timer, setup),
        cmocka_unit_test_setup(an_irq_line_that_is_low_for_no_reason_is_a_stuck_chip, setup),
        cmocka_unit_test_setup(lost_registers_are_seen, setup),
        cmocka_unit_test_setup(a_dead_chip_is_tried_again, setup),
    };
    return cmocka_run_group_tests_name("nrf24 faults", tests, NULL, NULL);
}
