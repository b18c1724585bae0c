/* Ports A to C, E3, and the peripheral pin select. */
#include "outside.h"
#include "parts.h"

#define PINS (8u * PIC_PORTS)

static bool bit_of(const pic *p, unsigned address, unsigned pin)
{
    return ((unsigned)p->mem[address + pin / 8u] & 1u << pin % 8u) != 0;
}

static bool is_analog(const pic *p, unsigned pin)
{
    static const uint16_t ANSEL[PIC_PORTS] = {R_ANSELA, R_ANSELB, R_ANSELC};
    return (p->mem[ANSEL[pin / 8u]] & 1u << pin % 8u) != 0;
}

static bool is_open_drain(const pic *p, unsigned pin)
{
    static const uint16_t ODCON[PIC_PORTS] = {0x1F3A, 0x1F45, 0x1F50};
    return (p->mem[ODCON[pin / 8u]] & 1u << pin % 8u) != 0;
}

int ports_driven(const pic *p, unsigned pin)
{
    if (pin >= PINS || bit_of(p, R_TRISA, pin) ||
        p->mem[R_RA0PPS + pin] != 0) { /* a peripheral's output is its own matter */
        return -1;
    }
    const int level = bit_of(p, R_LATA, pin) ? 1 : 0;
    return level == 1 && is_open_drain(p, pin) ? -1 : level;
}

bool ports_routes_out(const pic *p, unsigned pin, uint8_t function) { return p->mem[R_RA0PPS + pin] == function; }

bool ports_is_digital_input(const pic *p, unsigned pin)
{
    return pin < PINS && bit_of(p, R_TRISA, pin) && !is_analog(p, pin);
}

static int driven_on(const void *context, unsigned pin) { return ports_driven(context, pin); }

void ports_changed(pic *p) { outside_pins_changed(p->outside, driven_on, p, pic_ns(p)); }

static uint8_t read_port(pic *p, unsigned port)
{
    unsigned value = 0;
    const uint64_t ns = pic_ns(p);
    for (unsigned bit = 0; bit < 8u; ++bit) {
        const unsigned pin = port * 8u + bit;
        if (!is_analog(p, pin) && outside_pin(p->outside, pin, ports_driven(p, pin), ns)) {
            value |= 1u << bit;
        }
    }
    return (uint8_t)value;
}

uint8_t ports_read(pic *p, uint16_t address)
{
    if (address >= R_PORTA && address < R_PORTA + PIC_PORTS) {
        return read_port(p, address - (unsigned)R_PORTA);
    }
    return address == R_PORTE ? 0x08u : p->mem[address]; /* RE3 is MCLR, high */
}

static bool is_pps(uint16_t address) { return address >= R_SSP1CLKPPS && address < R_RA0PPS + (int)PINS; }

void ports_write(pic *p, uint16_t address, uint8_t value)
{
    if (is_pps(address)) {
        if ((p->mem[R_PPSLOCK] & 1u) == 0) {
            p->mem[address] = value & 0x1Fu;
        }
        return;
    }
    if (address >= R_PORTA && address < R_PORTA + PIC_PORTS) { /* a port is written through its latch */
        address = (uint16_t)(address - R_PORTA + R_LATA);
    }
    if (p->mem[address] != value) {
        p->mem[address] = value;
        ports_changed(p);
    }
}
