/* The two MSSP modules: registers and the flags that both modes share. I2C is in mssp_i2c.c (module 1), SPI in
 * mssp_spi.c. */
#include "parts.h"

enum { BUF, ADD, MSK, STAT, CON1, CON2, CON3 };

static unsigned base_of(unsigned unit) { return unit == 0 ? R_SSP1BUF : R_SSP2BUF; }

static bool is_on(const pic *p, unsigned unit) { return (p->mem[base_of(unit) + CON1] & SSP_SSPEN) != 0; }

static unsigned mode(const pic *p, unsigned unit) { return p->mem[base_of(unit) + CON1] & 15u; }

bool i2c_mode(const pic *p) { return is_on(p, 0) && mode(p, 0) == 8u; }

static bool spi_mode(const pic *p, unsigned unit)
{
    const unsigned m = mode(p, unit);
    return is_on(p, unit) && (m <= 2u || m == 10u);
}

void ssp_reset(pic *p)
{
    for (unsigned unit = 0; unit < 2; ++unit) {
        const pic_ssp idle = {SSP_IDLE, false, 0};
        p->ssp[unit] = idle;
    }
    p->mem[R_SSP1MSK] = 0xFF;
    p->mem[R_SSP2MSK] = 0xFF;
}

uint8_t ssp_read(pic *p, uint16_t address)
{
    const unsigned unit = address >= R_SSP2BUF ? 1 : 0;
    const unsigned base = base_of(unit);
    if (address == base + BUF) {
        p->mem[base + STAT] &= (uint8_t)~SSP_BF;
    }
    return p->mem[address];
}

static void write_buffer(pic *p, unsigned unit, uint8_t value)
{
    const unsigned base = base_of(unit);
    if (p->ssp[unit].doing != SSP_IDLE) {
        p->mem[base + CON1] |= SSP_WCOL;
        ++p->bus_misuse;
    } else if (spi_mode(p, unit)) {
        spi_begin(p, unit, value);
    } else if (unit == 0 && i2c_mode(p)) {
        p->mem[base + BUF] = value;
        i2c_begin(p, SSP_SEND);
    } else {
        p->mem[base + BUF] = value;
        ++p->bus_misuse;
    }
}

static ssp_activity asked(uint8_t bits)
{
    switch (bits & (SSP_SEN | SSP_RSEN | SSP_PEN | SSP_RCEN | SSP_ACKEN)) {
    case 0:
        return SSP_IDLE;
    case SSP_SEN:
        return SSP_START;
    case SSP_RSEN:
        return SSP_RESTART;
    case SSP_PEN:
        return SSP_STOP;
    case SSP_RCEN:
        return SSP_RECEIVE;
    case SSP_ACKEN:
        return SSP_ACK;
    default:
        return SSP_SPI; /* more than one thing */
    }
}

static void write_con2(pic *p, unsigned unit, uint8_t value)
{
    const unsigned at = base_of(unit) + CON2;
    const uint8_t orders = SSP_SEN | SSP_RSEN | SSP_PEN | SSP_RCEN | SSP_ACKEN;
    const uint8_t fresh = (uint8_t)(value & (uint8_t)~p->mem[at] & orders);
    const ssp_activity what = asked(fresh);
    p->mem[at] = (uint8_t)((p->mem[at] & (orders | SSP_ACKSTAT)) | (value & (uint8_t) ~(orders | SSP_ACKSTAT)));
    if (what == SSP_IDLE) {
        return;
    }
    if (unit != 0 || !i2c_mode(p) || what == SSP_SPI || p->ssp[0].doing != SSP_IDLE) {
        ++p->bus_misuse;
        return;
    }
    p->mem[at] |= fresh;
    i2c_begin(p, what);
}

static void write_con1(pic *p, unsigned unit, uint8_t value)
{
    const unsigned base = base_of(unit);
    p->mem[base + CON1] = value;
    if (!is_on(p, unit)) {
        const pic_ssp idle = {SSP_IDLE, false, 0};
        p->ssp[unit] = idle;
        p->events[EVENT_SSP1 + unit] = PIC_NEVER;
        p->mem[base + CON2] &= (uint8_t) ~(SSP_SEN | SSP_RSEN | SSP_PEN | SSP_RCEN | SSP_ACKEN);
        p->mem[base + STAT] &= 0xC0u;
    } else if (!spi_mode(p, unit) && !(unit == 0 && i2c_mode(p))) {
        pic_stray(p, (uint16_t)(base + CON1)); /* a mode that is not modelled */
    }
}

void ssp_write(pic *p, uint16_t address, uint8_t value)
{
    const unsigned unit = address >= R_SSP2BUF ? 1 : 0;
    const unsigned base = base_of(unit);
    switch (address - base) {
    case BUF:
        write_buffer(p, unit, value);
        break;
    case STAT: /* SMP and CKE can be written */
        p->mem[address] = (uint8_t)((value & 0xC0u) | (p->mem[address] & 0x3Fu));
        break;
    case CON1:
        write_con1(p, unit, value);
        break;
    case CON2:
        write_con2(p, unit, value);
        break;
    default:
        p->mem[address] = value;
        break;
    }
}

void ssp_event(pic *p, unsigned unit)
{
    if (p->ssp[unit].doing == SSP_SPI) {
        spi_end(p, unit);
    } else if (unit == 0) {
        i2c_end(p);
    } else {
        /* was switched off */
    }
}
