/* The emulated chip's peripherals: times and flags as data sheet DS40001866 gives them. Registers are written as the
 * program would; flash is full of NOPs, or of a few words. */
#include <string.h>

#include "cmocka_all.h"
#include "fake_outside.h"
#include "pic.h"
#include "registers.h"

#define CYCLES_PER_US 8u
#define SCL_CYCLES 20u /* 400 kHz */
#define CONFIG_32_MHZ 0x3F8Fu
#define CONFIG_WDT_OFF 0x3F9Fu
#define CONFIG_WDT_64_MS 0x3FE6u /* 1:2048 of 31 kHz, always on */
#define GOTO 0x2800u
#define NOP 0x0000u

static pic chip;
static struct outside around;

static void power_on(void)
{
    pic_program(&chip);
    pic_reset(&chip, RESET_BY_POWER);
}

static int set_up(void **state)
{
    (void)state;
    memset(&around, 0, sizeof around);
    pic_init(&chip, &around);
    memset(chip.words, 0, sizeof chip.words);
    chip.config[0] = CONFIG_32_MHZ;
    chip.config[2] = CONFIG_WDT_OFF;
    power_on();
    return 0;
}

static void wait(unsigned cycles) { pic_run(&chip, chip.cycles + cycles); }

static bool flag(unsigned bank, uint8_t bits) { return (chip.mem[R_PIR0 + bank] & bits) == bits; }

/* Cycles until the flag comes; it is cleared. */
static unsigned until_flag(unsigned bank, uint8_t bits)
{
    const uint64_t from = chip.cycles;
    while (!flag(bank, bits) && chip.cycles < from + 10000u) {
        pic_step(&chip);
    }
    assert_true(flag(bank, bits));
    pic_write(&chip, (uint16_t)(R_PIR0 + bank), (uint8_t)(chip.mem[R_PIR0 + bank] & (uint8_t)~bits));
    return (unsigned)(chip.cycles - from);
}

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
        cmocka_unit_test_setup(test_i2c_takes_its_clocks, set_up),
        cmocka_unit_test_setup(test_i2c_refusal_and_stretch, set_up),
        cmocka_unit_test_setup(test_i2c_collision, set_up),
        cmocka_unit_test_setup(test_i2c_misuse_is_counted, set_up),
        cmocka_unit_test_setup(test_spi, set_up),
        cmocka_unit_test_setup(test_adc, set_up),
        cmocka_unit_test_setup(test_timer_1, set_up),
        cmocka_unit_test_setup(test_timer_0_and_2, set_up),
        cmocka_unit_test_setup(test_uart, set_up),
        cmocka_unit_test_setup(test_interrupt_saves_and_restores, set_up),
        cmocka_unit_test_setup(test_watchdog, set_up),
        cmocka_unit_test_setup(test_a_hanging_program_is_reset, set_up),
        cmocka_unit_test_setup(test_stack_ends_in_a_reset, set_up),
        cmocka_unit_test_setup(test_status_as_destination, set_up),
        cmocka_unit_test_setup(test_banks, set_up),
        cmocka_unit_test_setup(test_ports_and_their_lock, set_up),
        cmocka_unit_test_setup(test_oscillator, set_up),
        cmocka_unit_test_setup(test_waits_take_their_time, set_up),
        cmocka_unit_test_setup(test_a_wait_ends_with_its_event, set_up),
        cmocka_unit_test_setup(test_idle_until_an_interrupt, set_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
