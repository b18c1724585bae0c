/* The emulated core's interrupts, stack, status and banks, and the ports: as data sheet DS40001866 gives them. */
#include "powered_chip.h"

#define GOTO 0x2800u

static void test_interrupt_saves_and_restores(void **state)
{
    (void)state;
    /* 4: CLRF FSR0L; MOVLB 5; MOVLW 0; BCF PIR4,0 is done by hand; RETFIE */
    const uint16_t handler[] = {0x0184, 0x0145, 0x3000, 0x0009};
    memcpy(&chip.words[4], handler, sizeof handler);
    chip.words[0] = GOTO | 0x100u;
    power_on();
    pic_write(&chip, R_T1CLK, 1);
    pic_write(&chip, R_TMR1H, 0xFF);
    pic_write(&chip, R_TMR1L, 0xC0);
    pic_write(&chip, R_PIE0 + 4, PIR4_TMR1);
    pic_write(&chip, R_T1CON, 1);
    chip.w = 0x5A;
    chip.bsr = 3;
    chip.fsr[0] = 0x2345;
    chip.status |= STATUS_C;
    wait(200);
    assert_int_equal(chip.pc > 0x100u, 1); /* not allowed yet */
    pic_write(&chip, R_INTCON, INTCON_GIE);
    wait(1);
    assert_true(chip.pc > 0x100u); /* timer 1 wants PEIE as well */
    const uint64_t before = chip.cycles;
    pic_write(&chip, R_INTCON, INTCON_GIE | INTCON_PEIE);
    pic_step(&chip);
    assert_int_equal(chip.pc, 4);
    assert_int_equal(chip.cycles - before, 1u + 3u);
    assert_int_equal(chip.intcon & INTCON_GIE, 0);
    pic_write(&chip, R_PIR0 + 4, 0);
    pic_step(&chip);
    pic_step(&chip);
    pic_step(&chip);
    assert_int_equal(chip.bsr, 5);
    pic_step(&chip);
    assert_int_equal(chip.w, 0x5A);
    assert_int_equal(chip.bsr, 3);
    assert_int_equal(chip.fsr[0], 0x2345);
    assert_int_equal(chip.status & STATUS_C, STATUS_C);
    assert_true((chip.intcon & INTCON_GIE) != 0);
    assert_int_equal(chip.deepest, 1);
}

static void test_stack_ends_in_a_reset(void **state)
{
    (void)state;
    chip.words[0] = 0x2000; /* CALL 0 */
    power_on();
    wait(2u * 16u);
    assert_int_equal(chip.resets[RESET_BY_OVERFLOW], 0);
    assert_int_equal(chip.deepest, 16);
    wait(2);
    assert_int_equal(chip.resets[RESET_BY_OVERFLOW], 1);
    assert_true((pic_read(&chip, R_PCON0) & PCON0_STKOVF) != 0);
    chip.words[0] = 0x0008; /* RETURN */
    power_on();
    pic_step(&chip);
    assert_int_equal(chip.resets[RESET_BY_UNDERFLOW], 1);
    chip.words[0] = 0x0001; /* RESET */
    power_on();
    pic_step(&chip);
    assert_int_equal(chip.resets[RESET_BY_INSTRUCTION], 1);
    assert_int_equal(pic_read(&chip, R_PCON0) & PCON0_RI, 0);
}

static void test_status_as_destination(void **state)
{
    (void)state;
    const uint16_t words[] = {0x0183, 0x30FF, 0x0083, 0x0703}; /* CLRF STATUS; MOVLW FF; MOVWF STATUS; ADDWF STATUS,W */
    memcpy(chip.words, words, sizeof words);
    power_on();
    pic_step(&chip);
    assert_int_equal(chip.status, STATUS_TO | STATUS_PD | STATUS_Z);
    pic_step(&chip);
    pic_step(&chip);
    assert_int_equal(chip.status, 0x1F);
    pic_step(&chip);
    assert_int_equal(chip.w, 0x1E);
    assert_int_equal(chip.status, STATUS_TO | STATUS_PD | STATUS_C | STATUS_DC);
}

static void test_banks(void **state)
{
    (void)state;
    const uint16_t words[] = {0x017F, 0x30A5, 0x00F0, 0x0159,
                              0x00A3}; /* MOVLB 63; MOVLW; MOVWF 70; MOVLB 25; MOVWF 23 */
    memcpy(chip.words, words, sizeof words);
    power_on();
    pic_step(&chip);
    assert_int_equal(chip.bsr, 63);
    wait(4);
    assert_int_equal(pic_read_far(&chip, 0x0470), 0xA5);               /* the common bytes are in every bank */
    assert_int_equal(pic_read_far(&chip, 0x2000 + 25 * 80 + 3), 0xA5); /* and the banks are one line for the FSRs */
    assert_int_equal(chip.stray_total, 0);
    pic_write(&chip, 0x0CC0, 1); /* behind the last byte of RAM */
    assert_int_equal(chip.strays[0x0CC0], 1);
    (void)pic_read_far(&chip, 0x27F0);
    assert_int_equal(chip.stray_total, 2);
    pic_write(&chip, R_NVMADRL, 1);
    assert_int_equal(chip.strays[R_NVMADRL], 1);
}

static void test_ports_and_their_lock(void **state)
{
    (void)state;
    around.pins_high = 1u << PIN_RB0;
    assert_int_equal(pic_read(&chip, R_PORTA + 1), 0); /* analog */
    pic_write(&chip, R_ANSELB, 0);
    assert_int_equal(pic_read(&chip, R_PORTA + 1), 1);
    pic_write(&chip, R_PORTA + 1, 0x30); /* goes into the latch */
    pic_write(&chip, R_TRISA + 1, 0xCF);
    assert_int_equal(pic_read(&chip, R_LATA + 1), 0x30);
    assert_int_equal(around.driven_high, 0x3000);
    pic_write(&chip, 0x1F45, 0x20); /* open drain */
    assert_int_equal(around.driven_high, 0x1000);
    pic_write(&chip, R_PPSLOCK, 0x55);
    pic_write(&chip, R_PPSLOCK, 0xAA);
    pic_write(&chip, R_PPSLOCK, 1);
    pic_write(&chip, R_RA0PPS, PPS_TX1);
    assert_int_equal(pic_read(&chip, R_RA0PPS), 0);
    pic_write(&chip, R_PPSLOCK, 0); /* without the two keys */
    assert_int_equal(pic_read(&chip, R_PPSLOCK), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_interrupt_saves_and_restores, set_up),
        cmocka_unit_test_setup(test_stack_ends_in_a_reset, set_up),
        cmocka_unit_test_setup(test_status_as_destination, set_up),
        cmocka_unit_test_setup(test_banks, set_up),
        cmocka_unit_test_setup(test_ports_and_their_lock, set_up),
    };
    return cmocka_run_group_tests_name("emulator core", tests, NULL, NULL);
}
