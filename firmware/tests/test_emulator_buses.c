/* The emulated I2C, SPI and UART: times and flags as data sheet DS40001866 gives them. */
#include "powered_chip.h"

#define CYCLES_PER_US 8u
#define SCL_CYCLES 20u /* 400 kHz */

static void i2c_on(void)
{
    pic_write(&chip, R_ANSELC, 0);
    pic_write(&chip, R_RA0PPS + PIN_RC0 + 3u, PPS_SCL1);
    pic_write(&chip, R_RA0PPS + PIN_RC0 + 4u, PPS_SDA1);
    pic_write(&chip, R_SSP1ADD, SCL_CYCLES - 1u);
    pic_write(&chip, R_SSP1CON1, SSP_SSPEN | 8u);
}

static unsigned i2c_do(uint8_t order)
{
    pic_write(&chip, R_SSP1CON2, order);
    return until_flag(3, PIR3_SSP1);
}

static void test_i2c_takes_its_clocks(void **state)
{
    (void)state;
    around.acknowledges = true;
    around.i2c_bytes[0] = 0xA5;
    i2c_on();
    assert_int_equal(i2c_do(SSP_SEN), SCL_CYCLES);
    pic_write(&chip, R_SSP1BUF, 0xD1);
    assert_true((pic_read(&chip, R_SSP1STAT) & (SSP_BF | SSP_RW)) == (SSP_BF | SSP_RW));
    assert_int_equal(until_flag(3, PIR3_SSP1), 9u * SCL_CYCLES);
    assert_int_equal(pic_read(&chip, R_SSP1STAT) & (SSP_BF | SSP_RW | SSP_S), SSP_S);
    assert_int_equal(pic_read(&chip, R_SSP1CON2) & SSP_ACKSTAT, 0);
    assert_int_equal(i2c_do(SSP_RSEN), 3u * SCL_CYCLES / 2u);
    assert_int_equal(i2c_do(SSP_RCEN), 8u * SCL_CYCLES);
    assert_true((pic_read(&chip, R_SSP1STAT) & SSP_BF) != 0);
    assert_int_equal(pic_read(&chip, R_SSP1BUF), 0xA5);
    assert_int_equal(pic_read(&chip, R_SSP1STAT) & SSP_BF, 0);
    assert_int_equal(i2c_do(SSP_ACKEN | SSP_ACKDT), SCL_CYCLES);
    assert_int_equal(i2c_do(SSP_PEN), 3u * SCL_CYCLES / 2u);
    assert_true((pic_read(&chip, R_SSP1STAT) & SSP_P) != 0);
    assert_int_equal(around.i2c_sent[0], 0xD1);
    assert_int_equal(around.starts, 2);
    assert_int_equal(around.stops, 1);
    assert_int_equal(around.nacks, 1);
    assert_int_equal(chip.bus_misuse, 0);
}

static void test_i2c_refusal_and_stretch(void **state)
{
    (void)state;
    i2c_on();
    (void)i2c_do(SSP_SEN);
    around.scl_until = pic_ns(&chip) + 100000u;
    pic_write(&chip, R_SSP1BUF, 0x50);
    const unsigned took = until_flag(3, PIR3_SSP1);
    assert_in_range(took, 100u * CYCLES_PER_US + 9u * SCL_CYCLES, 100u * CYCLES_PER_US + 9u * SCL_CYCLES + 2u);
    assert_true((pic_read(&chip, R_SSP1CON2) & SSP_ACKSTAT) != 0);
    around.scl_until = PIC_NEVER; /* for ever: no flag, until the module is switched off */
    pic_write(&chip, R_SSP1BUF, 0x50);
    wait(100000);
    assert_false(flag(3, PIR3_SSP1));
    pic_write(&chip, R_SSP1CON1, 8u);
    pic_write(&chip, R_SSP1CON1, SSP_SSPEN | 8u);
    around.scl_until = 0;
    assert_int_equal(i2c_do(SSP_SEN), SCL_CYCLES);
}

static void test_i2c_collision(void **state)
{
    (void)state;
    i2c_on();
    around.sda_low = true;
    pic_write(&chip, R_SSP1CON2, SSP_SEN);
    (void)until_flag(3, PIR3_BCL1);
    assert_int_equal(pic_read(&chip, R_SSP1CON2) & SSP_SEN, 0);
    assert_int_equal(around.starts, 0);
}

static void test_i2c_misuse_is_counted(void **state)
{
    (void)state;
    i2c_on();
    pic_write(&chip, R_SSP1CON2, SSP_SEN);
    pic_write(&chip, R_SSP1CON2, SSP_SEN | SSP_PEN); /* before the START was through */
    assert_int_equal(chip.bus_misuse, 1);
    (void)until_flag(3, PIR3_SSP1);
    pic_write(&chip, R_SSP1BUF, 1);
    pic_write(&chip, R_SSP1BUF, 2);
    assert_true((pic_read(&chip, R_SSP1CON1) & SSP_WCOL) != 0);
    assert_int_equal(chip.bus_misuse, 2);
    (void)until_flag(3, PIR3_SSP1);
    pic_write(&chip, R_RA0PPS + PIN_RC0 + 4u, 0); /* SDA no longer on its pin */
    pic_write(&chip, R_SSP1BUF, 1);
    assert_int_equal(chip.bus_misuse, 3);
}

static void spi_on(void)
{
    pic_write(&chip, R_ANSELB, 0);
    pic_write(&chip, R_TRISA + 1, 0xF5);
    pic_write(&chip, R_RA0PPS + PIN_RB0 + 1u, PPS_SCK2);
    pic_write(&chip, R_RA0PPS + PIN_RB0 + 3u, PPS_SDO2);
    pic_write(&chip, R_SSP2STAT, 0x40);
    pic_write(&chip, R_SSP2CON1, SSP_SSPEN | 1u);
}

static void test_spi(void **state)
{
    (void)state;
    around.spi_answer = 0x0E;
    spi_on();
    pic_write(&chip, R_SSP2BUF, 0xFF);
    assert_int_equal(until_flag(3, PIR3_SSP2), 8u * 4u); /* FOSC / 16: 2 MHz */
    assert_int_equal(pic_read(&chip, R_SSP2BUF), 0x0E);
    assert_int_equal(around.spi_sent[0], 0xFF);
    pic_write(&chip, R_SSP2ADD, 7);
    pic_write(&chip, R_SSP2CON1, SSP_SSPEN | 10u);
    pic_write(&chip, R_SSP2BUF, 1);
    assert_int_equal(until_flag(3, PIR3_SSP2), 8u * 8u);
    assert_int_equal(chip.bus_misuse, 0);
    pic_write(&chip, R_TRISA + 1, 0xFF); /* SCK is an input now */
    pic_write(&chip, R_SSP2BUF, 1);
    assert_int_equal(chip.bus_misuse, 1);
}

static void test_uart(void **state)
{
    (void)state;
    pic_write(&chip, R_RA0PPS + PIN_RC0 + 6u, PPS_TX1);
    pic_write(&chip, R_TRISA + 2, 0xBF);
    pic_write(&chip, R_SP1BRGL, 16);
    pic_write(&chip, R_BAUD1CON, 0x08);
    pic_write(&chip, R_RC1STA, 0x80);
    pic_write(&chip, R_TX1STA, 0x24);
    assert_true(flag(3, PIR3_TX1));
    pic_write(&chip, R_TX1REG, 0x11);
    assert_true(flag(3, PIR3_TX1)); /* moved on at once */
    pic_write(&chip, R_TX1REG, 0x22);
    assert_false(flag(3, PIR3_TX1));
    pic_write(&chip, R_PIR0 + 3, PIR3_TX1); /* cannot be written */
    assert_false(flag(3, PIR3_TX1));
    wait(170);
    assert_true(flag(3, PIR3_TX1));
    assert_int_equal(pic_read(&chip, R_TX1STA) & 2u, 0);
    wait(170);
    assert_int_equal(pic_read(&chip, R_TX1STA) & 2u, 2);
    assert_int_equal(around.uart_count, 2);
    assert_int_equal(around.uart[1], 0x22);
    assert_in_range(around.uart_ns[1] - around.uart_ns[0], 170u * 125u, 172u * 125u);
    assert_int_equal(chip.bus_misuse, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_i2c_takes_its_clocks, set_up),
        cmocka_unit_test_setup(test_i2c_refusal_and_stretch, set_up),
        cmocka_unit_test_setup(test_i2c_collision, set_up),
        cmocka_unit_test_setup(test_i2c_misuse_is_counted, set_up),
        cmocka_unit_test_setup(test_spi, set_up),
        cmocka_unit_test_setup(test_uart, set_up),
    };
    return cmocka_run_group_tests_name("emulator buses", tests, NULL, NULL);
}
