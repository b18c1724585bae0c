/* Events, interrupts, resets, oscillator, watchdog. */
#include <string.h>

#include "outside.h"
#include "parts.h"

#define INTERRUPT_VECTOR 4u
#define INTERRUPT_CYCLES 3u  /* from the end of the instruction to the first one of the handler */
#define NS_4_MHZ 4000u       /* instruction cycle at 1 MHz */
#define WDT_BASE_NS 1032258u /* 32 periods of the 31 kHz oscillator */
#define WDT_SOFTWARE 0x1Fu
#define WDT_CLRWDT_FREE 7u
#define CONFIG2_STVREN 0x1000u
#define CPUDOZE_IDLEN 0x80u
#define PPSLOCK_STEP 0x55u
#define PPSLOCK_STEP_2 0xAAu

void pic_at(pic *p, pic_event event, uint64_t cycles)
{
    p->events[event] = cycles;
    if (cycles < p->next_event) {
        p->next_event = cycles;
    }
}

uint64_t pic_ns(const pic *p)
{
    const double board_ns = (double)((p->cycles - p->base_cycles) * p->cycle_ns);
    return p->base_ns + (p->cycles - p->base_cycles) * p->cycle_ns - (uint64_t)(int64_t)(board_ns * p->ppm * 1e-6);
}

uint64_t pic_cycles_at(const pic *p, uint64_t ns)
{
    if (ns <= p->base_ns) {
        return p->base_cycles;
    }
    const double cycles = (double)(ns - p->base_ns) / (1.0 - p->ppm * 1e-6) / p->cycle_ns;
    return p->base_cycles + (uint64_t)cycles + 1u;
}

void pic_set_cycle_ns(pic *p, uint32_t cycle_ns)
{
    p->base_ns = pic_ns(p);
    p->base_cycles = p->cycles;
    p->cycle_ns = cycle_ns;
}

/* interrupts */

static bool wants_interrupt(const pic *p)
{
    if ((p->mem[R_PIR0] & p->mem[R_PIE0]) != 0) { /* timer 0 and the pins do without PEIE */
        return true;
    }
    for (unsigned i = 1; i < 8 && (p->intcon & INTCON_PEIE) != 0; ++i) {
        if ((p->mem[R_PIR0 + i] & p->mem[R_PIE0 + i]) != 0) {
            return true;
        }
    }
    return false;
}

void pic_look_at_interrupts(pic *p)
{
    if (((p->intcon & INTCON_GIE) != 0 || p->asleep) && wants_interrupt(p)) {
        p->next_event = 0;
    }
}

void pic_flag(pic *p, unsigned bank, uint8_t bits)
{
    p->mem[R_PIR0 + bank] |= bits;
    pic_look_at_interrupts(p);
}

void pic_unflag(pic *p, unsigned bank, uint8_t bits) { p->mem[R_PIR0 + bank] &= (uint8_t)~bits; }

static void interrupt(pic *p)
{
    uint8_t *shadow = &p->mem[R_STATUS_SHAD];
    shadow[0] = p->status & 7u;
    shadow[1] = p->w;
    shadow[2] = p->bsr;
    shadow[3] = p->pclath;
    shadow[4] = (uint8_t)p->fsr[0];
    shadow[5] = (uint8_t)(p->fsr[0] >> 8);
    shadow[6] = (uint8_t)p->fsr[1];
    shadow[7] = (uint8_t)(p->fsr[1] >> 8);
    p->intcon &= (uint8_t)~INTCON_GIE;
    p->cycles += INTERRUPT_CYCLES;
    pic_push(p, INTERRUPT_VECTOR);
}

static void run_event(pic *p, pic_event event)
{
    switch (event) {
    case EVENT_TMR0:
    case EVENT_TMR1:
    case EVENT_TMR2:
        timers_event(p, event);
        break;
    case EVENT_SSP1:
        ssp_event(p, 0);
        break;
    case EVENT_SSP2:
        ssp_event(p, 1);
        break;
    case EVENT_ADC:
        adc_event(p);
        break;
    case EVENT_TX1:
    case EVENT_RX1:
        uart_event(p, event);
        break;
    case EVENT_WDT:
        pic_reset(p, RESET_BY_WDT);
        break;
    case EVENT_END:
        break; /* pic_run looks at the clock itself */
    case EVENT_OUTSIDE:
    default:
        pic_at(p, EVENT_OUTSIDE, pic_cycles_at(p, outside_tick(p->outside, pic_ns(p))));
        break;
    }
}

void pic_service(pic *p)
{
    for (unsigned i = 0; i < EVENTS; ++i) {
        if (p->events[i] <= p->cycles) {
            p->events[i] = PIC_NEVER;
            run_event(p, (pic_event)i);
        }
    }
    p->next_event = PIC_NEVER;
    for (unsigned i = 0; i < EVENTS; ++i) {
        p->next_event = p->events[i] < p->next_event ? p->events[i] : p->next_event;
    }
    if (wants_interrupt(p)) {
        p->asleep = false;
        if ((p->intcon & INTCON_GIE) != 0) {
            interrupt(p);
        }
    }
}

void pic_sleep(pic *p)
{
    ++p->sleeps;
    pic_clear_wdt(p);
    p->status = (uint8_t)((p->status | STATUS_TO) & (uint8_t)~STATUS_PD);
    p->asleep = !wants_interrupt(p);
    p->next_event = 0;                              /* ends the run of instructions */
    if ((p->mem[R_CPUDOZE] & CPUDOZE_IDLEN) == 0) { /* without IDLEN the peripherals' clock would stop: not modelled */
        pic_stray(p, R_CPUDOZE);
    }
}

/* watchdog */

static unsigned wdt_scale(const pic *p)
{
    const unsigned fixed = p->config[2] & 0x1Fu;
    if (fixed != WDT_SOFTWARE) {
        return fixed;
    }
    return (p->mem[R_WDTCON0] >> 1) & 0x1Fu;
}

static bool wdt_on(const pic *p)
{
    const unsigned mode = (p->config[2] >> 5) & 3u;
    return mode >= 2u || (mode == 1u && (p->mem[R_WDTCON0] & 1u) != 0);
}

static uint64_t wdt_period_ns(const pic *p)
{
    const unsigned scale = wdt_scale(p);
    return (uint64_t)WDT_BASE_NS << (scale <= 18u ? scale : 0u);
}

/* Part of the period, in eighths, that has to pass before it may be cleared. */
static unsigned wdt_closed_eighths(const pic *p)
{
    const unsigned fixed = (p->config[2] >> 8) & 7u;
    const unsigned window = fixed != WDT_CLRWDT_FREE ? fixed : p->mem[R_WDTCON1] & 7u;
    return 7u - window;
}

void wdt_rearm(pic *p)
{
    p->events[EVENT_WDT] = PIC_NEVER;
    if (wdt_on(p)) {
        pic_at(p, EVENT_WDT, pic_cycles_at(p, p->wdt_cleared + wdt_period_ns(p)));
    }
}

void pic_clear_wdt(pic *p)
{
    const uint64_t now = pic_ns(p);
    const bool early = wdt_on(p) && (now - p->wdt_cleared) * 8u < wdt_period_ns(p) * wdt_closed_eighths(p);
    if (early) {
        pic_reset(p, RESET_BY_WDT_WINDOW);
        return;
    }
    p->wdt_cleared = now;
    p->status |= STATUS_TO | STATUS_PD;
    wdt_rearm(p);
}

/* resets */

static uint8_t pcon0_after(uint8_t before, pic_reset_cause cause)
{
    switch (cause) {
    case RESET_BY_POWER:
        return 0x3Cu; /* POR and BOR low */
    case RESET_BY_BROWN_OUT:
        return (uint8_t)((before | 0x3Cu) & (uint8_t)~PCON0_BOR);
    case RESET_BY_WDT:
        return (uint8_t)(before & (uint8_t)~PCON0_RWDT);
    case RESET_BY_WDT_WINDOW:
        return (uint8_t)(before & (uint8_t)~PCON0_WDTWV);
    case RESET_BY_INSTRUCTION:
        return (uint8_t)(before & (uint8_t)~PCON0_RI);
    case RESET_BY_OVERFLOW:
        return (uint8_t)(before | PCON0_STKOVF);
    case RESET_BY_UNDERFLOW:
    default:
        return (uint8_t)(before | PCON0_STKUNF);
    }
}

static void reset_oscillator(pic *p)
{
    const unsigned rstosc = (p->config[0] >> 4) & 7u;
    const bool fast = rstosc <= 1u;
    p->mem[R_OSCCON1] = (uint8_t)(rstosc << 4);
    p->mem[R_OSCCON2] = p->mem[R_OSCCON1];
    p->mem[R_OSCFRQ] = fast ? 6u : 0u;
    p->mem[R_OSCCON3] = 0x10u; /* ORDY */
    p->mem[R_OSCSTAT] = 0x50u; /* HFOR, MFOR */
    pic_set_cycle_ns(p, fast ? NS_4_MHZ / 32u : NS_4_MHZ);
}

static void reset_registers(pic *p)
{
    for (unsigned at = 0; at < PIC_DATA; ++at) {
        const unsigned f = at % 0x80u;
        if (f >= R_CORE_END && f < 0x20u) {
            p->mem[at] = 0;
        }
    }
    for (unsigned at = 0x1E00; at < 0x1F70; ++at) { /* banks 60 to 62 have registers up to 0x6F */
        if (at % 0x80u >= 0x20u && at % 0x80u < 0x70u) {
            p->mem[at] = 0;
        }
    }
    memset(&p->mem[R_TRISA], 0xFF, PIC_PORTS);
    p->mem[R_ANSELA] = 0xFF;
    p->mem[R_ANSELB] = 0xFF;
    p->mem[R_ANSELC] = 0xFF;
    p->mem[R_T2PR] = 0xFF;
    p->mem[R_TMR0H] = 0xFF;
    p->mem[R_SSP1CLKPPS] = PIN_RC0 + 3u;
    p->mem[R_SSP1DATPPS] = PIN_RC0 + 4u;
    p->mem[R_SSP2CLKPPS] = PIN_RB0 + 1u;
    p->mem[R_SSP2DATPPS] = PIN_RB0 + 2u;
    p->mem[R_RX1DTPPS] = PIN_RC0 + 7u;
    p->mem[R_TX1CKPPS] = PIN_RC0 + 6u;
    p->mem[R_WDTCON0] = (uint8_t)((p->config[2] & 0x1Fu) == WDT_SOFTWARE ? 0x16u : (p->config[2] & 0x1Fu) << 1);
    p->mem[R_WDTCON1] = (uint8_t)((p->config[2] >> 8) & 7u);
}

void pic_reset(pic *p, pic_reset_cause cause)
{
    const bool overflow = cause == RESET_BY_OVERFLOW || cause == RESET_BY_UNDERFLOW;
    const uint8_t pcon0 = pcon0_after(p->mem[R_PCON0], cause);
    if (overflow && (p->config[1] & CONFIG2_STVREN) == 0) { /* told, but no reset */
        p->mem[R_PCON0] = pcon0;
        return;
    }
    const uint8_t kept = p->status;
    p->status = cause == RESET_BY_POWER || cause == RESET_BY_BROWN_OUT ? STATUS_TO | STATUS_PD
                : cause == RESET_BY_WDT                                ? kept & (uint8_t)~STATUS_TO
                                                                       : kept;
    p->status &= (uint8_t)(STATUS_TO | STATUS_PD);
    ++p->resets[cause];
    p->last_reset = cause;
    p->pc = 0;
    p->bsr = 0;
    p->pclath = 0;
    p->intcon = 0;
    p->stkptr = 0x1Fu;
    p->asleep = false;
    for (unsigned i = 0; i < EVENTS; ++i) {
        p->events[i] = i == EVENT_OUTSIDE || i == EVENT_END ? p->events[i] : PIC_NEVER;
    }
    reset_registers(p);
    p->mem[R_PCON0] = pcon0;
    reset_oscillator(p);
    timers_reset(p);
    ssp_reset(p);
    uart_reset(p);
    p->wdt_cleared = pic_ns(p);
    wdt_rearm(p);
    const bool power = cause == RESET_BY_POWER || cause == RESET_BY_BROWN_OUT;
    outside_reset(p->outside, power, pic_ns(p));
    ports_changed(p);
    p->next_event = 0; /* to be worked out anew */
    if (p->watch.call != NULL) {
        p->watch.call(p->watch.context, 0);
    }
}

void pic_init(pic *p, struct outside *outside)
{
    memset(p, 0, sizeof *p);
    memset(p->words, 0xFF, sizeof p->words);
    memset(p->config, 0xFF, sizeof p->config);
    for (unsigned i = 0; i < EVENTS; ++i) {
        p->events[i] = PIC_NEVER;
    }
    p->cycle_ns = NS_4_MHZ;
    p->events[EVENT_OUTSIDE] = 0;
    p->outside = outside;
    pic_map_memory(p);
}

/* registers */

static void set_oscillator(pic *p)
{
    static const uint8_t MHZ[8] = {1, 2, 4, 8, 12, 16, 32, 0};
    const unsigned source = (p->mem[R_OSCCON1] >> 4) & 7u;
    const unsigned divider = p->mem[R_OSCCON1] & 15u;
    const unsigned mhz = source == 6u ? MHZ[p->mem[R_OSCFRQ] & 7u] : source <= 1u ? 32u : 0u;
    p->mem[R_OSCCON2] = p->mem[R_OSCCON1];
    if (mhz == 0 || mhz == 12u || divider > 9u) {
        pic_stray(p, R_OSCCON1);
        return;
    }
    pic_set_cycle_ns(p, NS_4_MHZ / mhz << divider);
    wdt_rearm(p);
}

static void write_ppslock(pic *p, uint8_t value)
{
    if (value == PPSLOCK_STEP) {
        p->pps_key = 1;
    } else if (value == PPSLOCK_STEP_2 && p->pps_key == 1) {
        p->pps_key = 2;
    } else {
        if (p->pps_key == 2) {
            p->mem[R_PPSLOCK] = value & 1u;
        }
        p->pps_key = 0;
    }
}

static void write_pir(pic *p, uint16_t address, uint8_t value)
{
    const uint8_t read_only = address == R_PIR0 + 3 ? PIR3_TX1 | PIR3_RC1 : 0;
    p->mem[address] = (uint8_t)((value & (uint8_t)~read_only) | (p->mem[address] & read_only));
    pic_look_at_interrupts(p);
}

void system_write(pic *p, uint16_t address, uint8_t value)
{
    switch (address) {
    case R_WDTCON0:
    case R_WDTCON1:
        p->mem[address] = value;
        wdt_rearm(p);
        return;
    case R_OSCCON1:
    case R_OSCFRQ:
        p->mem[address] = value;
        set_oscillator(p);
        return;
    case R_PPSLOCK:
        write_ppslock(p, value);
        return;
    case R_STKPTR:
        p->stkptr = value & 0x1Fu;
        return;
    case R_TOSL:
    case R_TOSH:
        if (p->stkptr < PIC_STACK) {
            uint16_t *top = &p->stack[p->stkptr];
            *top = (uint16_t)(address == R_TOSL ? (*top & 0xFF00u) | value : (*top & 0xFFu) | (value & 0x7Fu) << 8);
        }
        return;
    default:
        break;
    }
    if (address >= R_PIR0 && address < R_PIR0 + 8) {
        write_pir(p, address, value);
    } else if (address >= R_PIE0 && address < R_PIE0 + 8) {
        p->mem[address] = value;
        pic_look_at_interrupts(p);
    } else if (address == R_OSCCON3 || address == R_OSCEN || address == R_OSCTUNE) {
        p->mem[address] = value;
    } else {
        pic_stray(p, address); /* read only, or not modelled */
    }
}

uint8_t system_read(pic *p, uint16_t address)
{
    if (address == R_STKPTR) {
        return p->stkptr;
    }
    if (address == R_TOSL || address == R_TOSH) {
        const uint16_t top = p->stkptr < PIC_STACK ? p->stack[p->stkptr] : 0;
        return (uint8_t)(address == R_TOSL ? top : top >> 8);
    }
    if (address >= R_WDTPSL && address <= R_WDTTMR) {
        pic_stray(p, address);
    }
    return p->mem[address];
}
