/* The windowed watchdog. */
#include "parts.h"

#define WDT_BASE_NS 1032258u /* 32 periods of the 31 kHz oscillator */
#define WDT_CLRWDT_FREE 7u

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
