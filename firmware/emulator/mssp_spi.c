/* A MSSP module as SPI master, mode 0 (CKP 0, CKE 1), on the board's pins. */
#include "outside.h"
#include "parts.h"

#define BITS 8u
#define SCK_PIN (PIN_RB0 + 1u)
#define SDI_PIN (PIN_RB0 + 2u)
#define SDO_PIN (PIN_RB0 + 3u)
#define STAT_CKE 0x40u
#define CON1_CKP 0x10u

static bool is_output(const pic *p, unsigned pin) { return (p->mem[R_TRISA + pin / 8u] & 1u << pin % 8u) == 0; }

static bool is_wired(const pic *p, unsigned unit)
{
    return unit == 1 && ports_routes_out(p, SCK_PIN, PPS_SCK2) && ports_routes_out(p, SDO_PIN, PPS_SDO2) &&
           p->mem[R_SSP2DATPPS] == SDI_PIN && p->mem[R_SSP2CLKPPS] == SCK_PIN && is_output(p, SCK_PIN) &&
           is_output(p, SDO_PIN) && ports_is_digital_input(p, SDI_PIN) && (p->mem[R_SSP2STAT] & STAT_CKE) != 0 &&
           (p->mem[R_SSP2CON1] & CON1_CKP) == 0;
}

/* Cycles of one bit: FOSC / 4, / 16, / 64, or by SSPxADD. */
static uint32_t bit_cycles(const pic *p, unsigned unit)
{
    const unsigned mode = p->mem[unit == 0 ? R_SSP1CON1 : R_SSP2CON1] & 15u;
    return mode == 0u ? 1u : mode == 1u ? 4u : mode == 2u ? 16u : p->mem[unit == 0 ? R_SSP1ADD : R_SSP2ADD] + 1u;
}

void spi_begin(pic *p, unsigned unit, uint8_t value)
{
    p->ssp[unit].doing = SSP_SPI;
    p->ssp[unit].shift = value;
    p->mem[unit == 0 ? R_SSP1STAT : R_SSP2STAT] &= (uint8_t)~SSP_BF;
    if (!is_wired(p, unit)) {
        ++p->bus_misuse;
    }
    pic_at(p, (pic_event)(EVENT_SSP1 + unit), p->cycles + (uint64_t)BITS * bit_cycles(p, unit));
}

void spi_end(pic *p, unsigned unit)
{
    const unsigned base = unit == 0 ? R_SSP1BUF : R_SSP2BUF;
    const uint8_t in = is_wired(p, unit) ? outside_spi(p->outside, p->ssp[unit].shift, pic_ns(p)) : 0xFFu;
    p->ssp[unit].doing = SSP_IDLE;
    p->mem[base] = in;
    p->mem[base + (R_SSP1STAT - R_SSP1BUF)] |= SSP_BF;
    pic_flag(p, 3, unit == 0 ? PIR3_SSP1 : PIR3_SSP2);
}
