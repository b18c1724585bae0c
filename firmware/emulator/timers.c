/* TMR0, TMR1, TMR2: free running and as periods. Gates and external clocks are not modelled. */
#include "parts.h"

#define FULL_8 0x100u
#define FULL_16 0x10000u
#define HFINTOSC_MHZ 32u

static bool is_wide_0(const pic *p) { return (p->mem[R_T0CON0] & 0x10u) != 0; }

/* Ticks until the counter comes round. */
static uint32_t modulus(const pic *p, unsigned unit)
{
    if (unit == 1) {
        return FULL_16;
    }
    if (unit == 0) {
        return is_wide_0(p) ? FULL_16 : p->mem[R_TMR0H] + 1u;
    }
    return p->mem[R_T2PR] + 1u;
}

static uint64_t ticks(const pic *p, const pic_timer *t)
{
    return t->on && t->per_tick != 0 ? (p->cycles - t->since) / t->per_tick : 0;
}

static uint32_t value_of(const pic *p, unsigned unit)
{
    const pic_timer *t = &p->timer[unit];
    return (uint32_t)((t->value + ticks(p, t)) % modulus(p, unit));
}

static void arm(pic *p, unsigned unit)
{
    pic_timer *t = &p->timer[unit];
    p->events[EVENT_TMR0 + unit] = PIC_NEVER;
    if (t->on && t->per_tick != 0) {
        const uint32_t round = modulus(p, unit);
        const uint32_t left =
            t->value < round ? round - t->value : FULL_8 - t->value + round; /* PR set below the count */
        pic_at(p, (pic_event)(EVENT_TMR0 + unit), t->since + (uint64_t)left * t->per_tick);
    }
}

static void set(pic *p, unsigned unit, uint32_t value)
{
    pic_timer *t = &p->timer[unit];
    t->value = value;
    t->since = p->cycles; /* a write clears the prescaler as well */
    arm(p, unit);
}

static void settings(pic *p, unsigned unit, bool on, uint32_t cycles, unsigned shift)
{
    pic_timer *t = &p->timer[unit];
    const uint32_t value = value_of(p, unit);
    t->on = on;
    t->per_tick = cycles << shift;
    set(p, unit, value);
}

/* Instruction cycles of a clock of `khz`, 0 where it is no whole number of them. */
static uint32_t cycles_of(const pic *p, uint32_t khz)
{
    const uint32_t ns = 1000000u / khz;
    return ns % p->cycle_ns == 0 ? ns / p->cycle_ns : 0;
}

static void set_up_0(pic *p)
{
    const unsigned source = p->mem[R_T0CON1] >> 5;
    const uint32_t cycles = source == 2u ? 1u : source == 5u ? cycles_of(p, 500u) : 0u;
    if ((p->mem[R_T0CON0] & 0x80u) != 0 && cycles == 0) {
        pic_stray(p, R_T0CON1);
    }
    settings(p, 0, (p->mem[R_T0CON0] & 0x80u) != 0, cycles, p->mem[R_T0CON1] & 15u);
    p->timer[0].post = p->mem[R_T0CON0] & 15u;
}

static void set_up_1(pic *p)
{
    const unsigned source = p->mem[R_T1CLK] & 15u;
    const uint32_t cycles = source == 1u ? 1u : source == 5u ? cycles_of(p, 500u) : 0u;
    const bool on = (p->mem[R_T1CON] & 1u) != 0;
    if (on && cycles == 0) {
        pic_stray(p, R_T1CLK);
    }
    settings(p, 1, on, cycles, (p->mem[R_T1CON] >> 4) & 3u);
}

static void set_up_2(pic *p)
{
    const unsigned source = p->mem[R_T2CLKCON] & 15u;
    const uint32_t cycles = source == 1u ? 1u : source == 5u ? cycles_of(p, 500u) : 0u;
    const bool on = (p->mem[R_T2CON] & 0x80u) != 0;
    if (on && (cycles == 0 || (p->mem[R_T2HLT] & 0x1Fu) != 0)) { /* only the free-running mode */
        pic_stray(p, R_T2CLKCON);
    }
    settings(p, 2, on, cycles, (p->mem[R_T2CON] >> 4) & 7u);
    p->timer[2].post = p->mem[R_T2CON] & 15u;
}

void timers_reset(pic *p)
{
    const pic_timer off = {false, 0, 0, 0, 0};
    for (unsigned i = 0; i < 3; ++i) {
        p->timer[i] = off;
    }
}

void timers_event(pic *p, pic_event event)
{
    static const uint8_t FLAGS[3] = {PIR0_TMR0, PIR4_TMR1, PIR4_TMR2};
    static const uint8_t BANKS[3] = {0, 4, 4};
    const unsigned unit = (unsigned)event - EVENT_TMR0;
    pic_timer *t = &p->timer[unit];
    const uint32_t round = modulus(p, unit);
    const uint32_t left = t->value < round ? round - t->value : FULL_8 - t->value + round;
    t->since += (uint64_t)left * t->per_tick;
    t->value = 0;
    arm(p, unit);
    if (t->post > 0) {
        --t->post;
        return;
    }
    t->post = unit == 0 ? p->mem[R_T0CON0] & 15u : unit == 2 ? p->mem[R_T2CON] & 15u : 0u;
    pic_flag(p, BANKS[unit], FLAGS[unit]);
}

uint8_t timers_read(pic *p, uint16_t address)
{
    uint32_t value = 0;
    switch (address) {
    case R_TMR0L:
        value = value_of(p, 0);
        if (is_wide_0(p)) { /* the high byte is held for the next read of TMR0H */
            p->mem[R_TMR0H] = (uint8_t)(value >> 8);
        }
        return (uint8_t)value;
    case R_TMR1L:
        value = value_of(p, 1);
        if ((p->mem[R_T1CON] & 2u) != 0) { /* RD16 */
            p->mem[R_TMR1H] = (uint8_t)(value >> 8);
        }
        return (uint8_t)value;
    case R_TMR1H:
        return (p->mem[R_T1CON] & 2u) != 0 ? p->mem[R_TMR1H] : (uint8_t)(value_of(p, 1) >> 8);
    case R_T2TMR:
        return (uint8_t)value_of(p, 2);
    default:
        return p->mem[address];
    }
}

static void write_1(pic *p, uint16_t address, uint8_t value)
{
    const bool at_once = (p->mem[R_T1CON] & 2u) == 0;
    const uint32_t now = value_of(p, 1);
    if (address == R_TMR1H) {
        p->mem[R_TMR1H] = value;
        if (at_once) {
            set(p, 1, (now & 0xFFu) | (uint32_t)value << 8);
        }
    } else {
        set(p, 1, (at_once ? now & 0xFF00u : (uint32_t)p->mem[R_TMR1H] << 8) | value);
    }
}

void timers_write(pic *p, uint16_t address, uint8_t value)
{
    const uint32_t before = address == R_T2PR ? value_of(p, 2) : 0;
    if (address == R_TMR1L || address == R_TMR1H) {
        write_1(p, address, value);
        return;
    }
    p->mem[address] = value;
    switch (address) {
    case R_TMR0L:
        set(p, 0, is_wide_0(p) ? (uint32_t)p->mem[R_TMR0H] << 8 | value : value);
        break;
    case R_TMR0H:
        if (!is_wide_0(p)) {
            arm(p, 0);
        }
        break;
    case R_T0CON0:
    case R_T0CON1:
        set_up_0(p);
        break;
    case R_T1CON:
    case R_T1CLK:
        set_up_1(p);
        break;
    case R_T2TMR:
        set(p, 2, value);
        break;
    case R_T2PR:
        set(p, 2, before);
        break;
    default:
        set_up_2(p);
        break;
    }
}
