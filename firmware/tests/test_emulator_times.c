/* The emulated chip's clock, timers, ADC, watchdog and waits: times and flags as data sheet DS40001866 gives them. */
#include "powered_chip.h"

#define CYCLES_PER_US 8u
#define CONFIG_WDT_64_MS 0x3FE6u /* 1:2048 of 31 kHz, always on */
#define GOTO 0x2800u
#define NOP 0x0000u

static void test_adc(void **state)
{
    (void)state;
    around.adc_code = 0x2A5;
    pic_write(&chip, R_ADCON1, 0xA0); /* right, FOSC / 32 */
    pic_write(&chip, R_ADCON0, 0x05); /* channel 1, on */
    wait(5u * CYCLES_PER_US);
    pic_write(&chip, R_ADCON0, 0x07);
    assert_int_equal(until_flag(1, PIR1_AD), 23u * CYCLES_PER_US / 2u);
    assert_int_equal(pic_read(&chip, R_ADCON0) & ADCON0_GO, 0);
    assert_int_equal(pic_read(&chip, R_ADRESL), 0xA5);
    assert_int_equal(pic_read(&chip, R_ADRESH), 0x02);
    assert_int_equal(around.adc_channel, 1);
    assert_int_equal(chip.adc_rushed, 0);
    pic_write(&chip, R_ADCON1, 0x20);
    pic_write(&chip, R_ADCON0, 0x03); /* another channel, and at once */
    assert_int_equal(chip.adc_rushed, 1);
    (void)until_flag(1, PIR1_AD);
    assert_int_equal(pic_read(&chip, R_ADRESH), 0xA9);
    assert_int_equal(pic_read(&chip, R_ADRESL), 0x40);
    wait(5u * CYCLES_PER_US);
    pic_write(&chip, R_ADCON1, 0x40); /* TAD 0.125 us */
    pic_write(&chip, R_ADCON0, 0x03);
    assert_int_equal(chip.adc_rushed, 2);
}

static void test_timer_1(void **state)
{
    (void)state;
    pic_write(&chip, R_T1CLK, 1);
    pic_write(&chip, R_T1CON, 0x33); /* 1:8, RD16, on */
    wait(300u * CYCLES_PER_US);
    assert_int_equal(pic_read(&chip, R_TMR1L), 300 & 0xFF);
    wait(300u * CYCLES_PER_US);
    assert_int_equal(pic_read(&chip, R_TMR1H), 1); /* held since the low byte was read */
    pic_write(&chip, R_TMR1H, 0xFF);
    pic_write(&chip, R_TMR1L, 0xF0);
    assert_int_equal(until_flag(4, PIR4_TMR1), 16u * CYCLES_PER_US);
    wait(CYCLES_PER_US);
    assert_int_equal(pic_read(&chip, R_TMR1L), 1);
    pic_write(&chip, R_T1CON, 0x32); /* stopped */
    wait(100);
    assert_int_equal(pic_read(&chip, R_TMR1L), 1);
}

static void test_timer_0_and_2(void **state)
{
    (void)state;
    pic_write(&chip, R_T0CON1, 0x40); /* FOSC / 4 */
    pic_write(&chip, R_TMR0H, 99);
    pic_write(&chip, R_T0CON0, 0x81); /* 8 bits, every second match */
    assert_int_equal(until_flag(0, PIR0_TMR0), 200);
    assert_int_equal(until_flag(0, PIR0_TMR0), 200);
    pic_write(&chip, R_T0CON0, 0);
    pic_write(&chip, R_T0CON0, 0x90); /* 16 bits */
    pic_write(&chip, R_TMR0H, 0xFF);
    pic_write(&chip, R_TMR0L, 0x00);
    assert_int_equal(until_flag(0, PIR0_TMR0), 256);
    pic_write(&chip, R_T2CLKCON, 1);
    pic_write(&chip, R_T2PR, 249);
    pic_write(&chip, R_T2CON, 0xB0); /* 1:8 */
    assert_int_equal(until_flag(4, PIR4_TMR2), 2000);
    wait(80);
    assert_int_equal(pic_read(&chip, R_T2TMR), 10);
    assert_int_equal(chip.stray_total, 0);
    pic_write(&chip, R_T1CLK, 0); /* the external pin: not modelled */
    pic_write(&chip, R_T1CON, 1);
    assert_true(chip.stray_total > 0);
}

static void test_watchdog(void **state)
{
    (void)state;
    chip.config[2] = CONFIG_WDT_64_MS;
    chip.words[0] = GOTO;
    power_on();
    wait(60000u * CYCLES_PER_US);
    assert_int_equal(chip.resets[RESET_BY_WDT], 0);
    wait(10000u * CYCLES_PER_US);
    assert_int_equal(chip.resets[RESET_BY_WDT], 1);
    assert_int_equal(chip.status & (STATUS_TO | STATUS_PD), STATUS_PD);
    assert_int_equal(pic_read(&chip, R_PCON0) & PCON0_RWDT, 0);
    chip.words[0] = 0x0064; /* CLRWDT */
    chip.words[1] = GOTO;   /* kicks for ever */
    power_on();
    wait(300000u * CYCLES_PER_US);
    assert_int_equal(chip.resets[RESET_BY_WDT], 1);
    chip.config[2] = 0x3BE6; /* may be cleared in the second half only */
    power_on();
    wait(100);
    assert_true(chip.resets[RESET_BY_WDT_WINDOW] > 0);
    assert_int_equal(pic_read(&chip, R_PCON0) & PCON0_WDTWV, 0);
}

static void test_a_hanging_program_is_reset(void **state)
{
    (void)state;
    pic_hang(&chip); /* no watchdog: returns */
    chip.config[2] = CONFIG_WDT_64_MS;
    chip.words[0] = 0x0064;
    chip.words[1] = GOTO;
    power_on();
    wait(1000);
    const uint64_t from = pic_ns(&chip);
    pic_hang(&chip);
    assert_in_range(pic_ns(&chip) - from, 60000000u, 70000000u);
    assert_int_equal(chip.resets[RESET_BY_WDT], 1);
    wait(1000000);
    assert_int_equal(chip.resets[RESET_BY_WDT], 1); /* it kicks again */
}

static void test_oscillator(void **state)
{
    (void)state;
    chip.config[0] = 0x3FEF; /* HFINTOSC at 1 MHz */
    power_on();
    const uint64_t from = pic_ns(&chip);
    wait(1000);
    assert_int_equal(pic_ns(&chip) - from, 4000000);
    pic_write(&chip, R_OSCFRQ, 6);
    pic_write(&chip, R_OSCCON1, 0x60);
    wait(8000);
    assert_int_equal(pic_ns(&chip) - from, 5000000);
    chip.ppm = 1000;
    pic_write(&chip, R_OSCCON1, 0x61); /* halved, and fast by 0.1 % */
    const uint64_t later = pic_ns(&chip);
    wait(4000000);
    assert_int_equal(pic_ns(&chip) - later, 999000000);
}

/* 2: BTFSC 5F, 0; BRA out; DECFSZ WREG, F; BRA 2: the bit is never set. */
static void test_waits_take_their_time(void **state)
{
    (void)state;
    const uint16_t words[] = {0x3000 | 100, NOP, 0x185F, 0x3202, 0x0B89, 0x33FC, 0x0000, 0x2807};
    memcpy(chip.words, words, sizeof words);
    power_on();
    const uint64_t from = chip.cycles;
    while (chip.pc != 7u) {
        pic_step(&chip);
    }
    assert_int_equal(chip.w, 0);
    assert_int_equal(chip.cycles - from, 2u + 99u * 5u + 2u + 2u + 1u); /* the last DECFSZ skips */
    const uint16_t out[] = {0x3000 | 100, NOP, 0x181F, 0x3202, 0x0B89, 0x33FC, 0x0000, 0x2807};
    memcpy(chip.words, out, sizeof out);
    power_on();
    pic_write(&chip, R_ADCON1, 0xA0);
    chip.mem[0x1F] = 0; /* an address where the chip has nothing: looked at each time */
    const uint64_t again = chip.cycles;
    while (chip.pc != 7u) {
        pic_step(&chip);
    }
    assert_int_equal(chip.cycles - again, 2u + 99u * 5u + 2u + 2u + 1u);
    assert_int_equal(chip.stray_total, 100);
}

static void test_a_wait_ends_with_its_event(void **state)
{
    (void)state;
    /* MOVLB 14; MOVLW 255; BTFSC PIR1, 0; BRA out; DECFSZ WREG, F; BRA 2; (out) BRA self */
    const uint16_t words[] = {0x014E, 0x30FF, 0x180D, 0x3202, 0x0B89, 0x33FC, 0x33FF};
    memcpy(chip.words, words, sizeof words);
    power_on();
    pic_write(&chip, R_ADCON1, 0xA0);
    pic_write(&chip, R_ADCON0, 0x01);
    pic_write(&chip, R_ADCON0, 0x03); /* 92 cycles */
    const uint64_t from = chip.cycles;
    while (chip.pc != 6u) {
        pic_step(&chip);
    }
    /* MOVLB, MOVLW, then 18 rounds of 5 end at 92: the 19th test reads at 93 and sees it; BTFSC and BRA take 3 more */
    assert_int_equal(chip.cycles - from, 2u + 18u * 5u + 3u);
    assert_int_equal(chip.w, 255 - 18);
}

static void test_idle_until_an_interrupt(void **state)
{
    (void)state;
    chip.words[0] = 0x0063; /* SLEEP */
    power_on();
    pic_write(&chip, R_CPUDOZE, 0x80);
    pic_write(&chip, R_T2CLKCON, 1);
    pic_write(&chip, R_T2CON, 0x80);
    pic_write(&chip, R_PIE0 + 4, PIR4_TMR2);
    pic_write(&chip, R_INTCON, INTCON_PEIE);
    wait(300);
    assert_true(flag(4, PIR4_TMR2));
    assert_in_range(chip.pc, 30, 50); /* the rest of the time went by idle */
    assert_int_equal(chip.stray_total, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_adc, set_up),
        cmocka_unit_test_setup(test_timer_1, set_up),
        cmocka_unit_test_setup(test_timer_0_and_2, set_up),
        cmocka_unit_test_setup(test_watchdog, set_up),
        cmocka_unit_test_setup(test_a_hanging_program_is_reset, set_up),
        cmocka_unit_test_setup(test_oscillator, set_up),
        cmocka_unit_test_setup(test_waits_take_their_time, set_up),
        cmocka_unit_test_setup(test_a_wait_ends_with_its_event, set_up),
        cmocka_unit_test_setup(test_idle_until_an_interrupt, set_up),
    };
    return cmocka_run_group_tests_name("emulator times", tests, NULL, NULL);
}
