/* Events, interrupts, oscillator, and the registers of the system. */
#include "outside.h"
#include "parts.h"

#define INTERRUPT_VECTOR 4u
#define INTERRUPT_CYCLES 3u /* from the end of the instruction to the first one of the handler */
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
