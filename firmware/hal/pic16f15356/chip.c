/* Oscillator, pins, timer 1 as the clock of microseconds, watchdog, reset cause. */
#include "chip.h"

#include "clock.h"
#include "hal.h"

#define PCON0_BOR 0x01u
#define PCON0_POR 0x02u
#define PCON0_RI 0x04u
#define PCON0_RMCLR 0x08u
#define PCON0_RWDT 0x10u
#define PCON0_STKUNF 0x40u
#define PCON0_STKOVF 0x80u

#define T1CON_ON_1_TO_8_RD16 0x33u
#define T1CLK_FOSC_4 0x01u

volatile uint8_t clock_overflow_low;
volatile uint8_t clock_overflow_high;

static reset_cause cause;

/* PCON0's bits are low for what has happened, but for the stack's. */
static reset_cause why(uint8_t flags)
{
    if ((flags & PCON0_POR) == 0u) {
        return RESET_POWER_ON;
    }
    if ((flags & PCON0_BOR) == 0u) {
        return RESET_BROWN_OUT;
    }
    if ((flags & PCON0_RWDT) == 0u) {
        return RESET_WATCHDOG;
    }
    if ((flags & PCON0_RMCLR) == 0u) {
        return RESET_PIN;
    }
    if ((flags & PCON0_RI) == 0u || (flags & (PCON0_STKOVF | PCON0_STKUNF)) != 0u) {
        return RESET_SOFTWARE;
    }
    return RESET_UNKNOWN;
}

static void set_pins(void)
{
    CHIP_AT(ANSELA_AT) = 0x03u; /* RA0 and RA1 analog, all others digital */
    CHIP_AT(ANSELB_AT) = 0u;
    CHIP_AT(ANSELC_AT) = 0u;
    LATB = PIN_CSN;
    TRISB = (uint8_t)~(PIN_SCK | PIN_MOSI | PIN_CSN | PIN_CE);
    LATC = 0u; /* SCL and SDA as latches are only ever pulled low */
    TRISC = (uint8_t)~PIN_TX;
}

void chip_init(void)
{
    cause = why(PCON0);
    PCON0 = 0x3Fu;
    set_pins();
    clock_overflow_low = 0u;
    clock_overflow_high = 0u;
    T1CLK = T1CLK_FOSC_4;
    TMR1H = 0u;
    TMR1L = 0u;
    T1CON = T1CON_ON_1_TO_8_RD16;
    PIR4 = 0u;
    PIE4 = PIR4_TMR1IF;
    INTCON = INTCON_GIE | INTCON_PEIE;
}

uint32_t hal_micros(void)
{
    static union {
        uint8_t bytes[4];
        uint32_t value;
    } now; /* static: at a fixed address, byte by byte */
    do {   /* again where an overflow came in between */
        now.bytes[2] = clock_overflow_low;
        now.bytes[0] = TMR1L; /* latches the upper byte */
        now.bytes[1] = TMR1H;
        now.bytes[3] = clock_overflow_high;
    } while (now.bytes[2] != clock_overflow_low);
    return now.value;
}

void hal_watchdog_kick(void) { CHIP_CLEAR_WATCHDOG(); }

reset_cause hal_reset_cause(void) { return cause; }

void chip_point_fsr1(const uint8_t *data)
{
#ifdef __XC8
    FSR1L = (uint8_t)(uint16_t)data;
    FSR1H = (uint8_t)((uint16_t)data >> 8);
#else
    static union {
        const uint8_t *pointer;
        uint8_t bytes[3]; /* low, high, 0x80 for flash: which is where the FSR has flash, too */
    } parts;
    parts.pointer = data;
    FSR1L = parts.bytes[0];
    FSR1H = (uint8_t)(parts.bytes[1] | parts.bytes[2]);
#endif
}
