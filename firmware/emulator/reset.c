/* What each cause of a reset leaves in the chip. */
#include <string.h>

#include "outside.h"
#include "parts.h"

#define CONFIG2_STVREN 0x1000u

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
