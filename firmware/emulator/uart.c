/* EUSART1, asynchronous: a byte in TX1REG, one in the shift register. Reception is not modelled: the
 * firmware listens to nobody. */
#include "outside.h"
#include "parts.h"

#define BITS 10u
#define SPEN 0x80u
#define TXEN 0x20u
#define SYNC 0x10u
#define BRGH 0x04u
#define TRMT 0x02u
#define BRG16 0x08u
#define TX_PIN (PIN_RC0 + 6u)

static bool sends(const pic *p) { return (p->mem[R_RC1STA] & SPEN) != 0 && (p->mem[R_TX1STA] & TXEN) != 0; }

static bool is_wired(const pic *p)
{
    return ports_routes_out(p, TX_PIN, PPS_TX1) && (p->mem[R_TRISA + 2] >> 6 & 1u) == 0 &&
           (p->mem[R_TX1STA] & SYNC) == 0;
}

/* FOSC / (64, 16 or 4) / (n + 1), in instruction cycles of four clocks */
static uint64_t byte_cycles(const pic *p)
{
    const bool high = (p->mem[R_TX1STA] & BRGH) != 0;
    const bool wide = (p->mem[R_BAUD1CON] & BRG16) != 0;
    const unsigned clocks = high && wide ? 4u : high || wide ? 16u : 64u;
    const unsigned n = p->mem[R_SP1BRGL] | (wide ? (unsigned)p->mem[R_SP1BRGH] << 8 : 0u);
    return (uint64_t)BITS * (clocks / 4u) * (n + 1u);
}

void uart_reset(pic *p)
{
    p->tx_waiting = false;
    p->tx_shifting = false;
    p->mem[R_TX1STA] = TRMT;
    p->mem[R_BAUD1CON] = 0x40u; /* RCIDL */
}

static void look(pic *p)
{
    if (!sends(p)) {
        pic_unflag(p, 3, PIR3_TX1);
        return;
    }
    if (p->tx_waiting && !p->tx_shifting) {
        p->tx_waiting = false;
        p->tx_shifting = true;
        p->mem[R_TX1STA] &= (uint8_t)~TRMT;
        if (is_wired(p)) {
            outside_uart(p->outside, p->mem[R_TX1REG], pic_ns(p));
        } else {
            ++p->bus_misuse;
        }
        pic_at(p, EVENT_TX1, p->cycles + byte_cycles(p));
    }
    if (!p->tx_waiting) {
        pic_flag(p, 3, PIR3_TX1);
    }
}

void uart_event(pic *p, pic_event event)
{
    if (event == EVENT_TX1) {
        p->tx_shifting = false;
        p->mem[R_TX1STA] |= TRMT;
        look(p);
    }
}

uint8_t uart_read(pic *p, uint16_t address)
{
    if (address == R_RC1REG) {
        pic_stray(p, address);
    }
    return p->mem[address];
}

void uart_write(pic *p, uint16_t address, uint8_t value)
{
    const uint8_t before = p->mem[address];
    p->mem[address] = value;
    if (address == R_TX1REG) {
        if (p->tx_waiting) {
            ++p->bus_misuse; /* the byte before is lost */
        }
        p->tx_waiting = true;
        pic_unflag(p, 3, PIR3_TX1);
        look(p);
    } else if (address == R_TX1STA) {
        p->mem[address] = (uint8_t)((value & (uint8_t)~TRMT) | (before & TRMT));
        look(p);
    } else if (address == R_RC1STA) {
        look(p);
    } else {
        /* takes effect with the next byte */
    }
}
