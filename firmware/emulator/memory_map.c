/* The map of the data memory: which registers the chip has, and who answers there. */
#include "memory_map.h"

#include <stddef.h>
#include <string.h>

#include "parts.h"

#define GPR_END_LAST_BANK 0x0CC0u /* bank 25 has 32 bytes only */

typedef struct {
    uint16_t first;
    uint16_t last;
    uint8_t kind;
} range;

/* The special function registers that the chip has; the others are NOWHERE. Later entries win. */
static const range REGISTERS[] = {
    {0x00C, 0x00E, PORT},
    {0x010, 0x010, PORT},
    {0x012, 0x014, PORT},
    {0x018, 0x01A, PORT},
    {R_ADRESL, R_ADRESH, PLAIN},
    {R_ADCON0, R_ADCON1, ADC_UNIT},
    {R_ADACT, R_ADACT, UNMODELLED},
    {R_RC1REG, R_BAUD1CON, UART},
    {R_SSP1BUF, R_SSP1CON3, SSP},
    {R_SSP2BUF, R_SSP2CON3, SSP},
    {R_TMR1L, R_T1CON, TIMER},
    {R_T1GCON, R_T1GATE, UNMODELLED},
    {R_T1CLK, R_T1CLK, TIMER},
    {R_T2TMR, R_T2CLKCON, TIMER},
    {R_T2RST, R_T2RST, UNMODELLED},
    {0x30C, 0x316, UNMODELLED},
    {0x318, 0x31A, UNMODELLED},
    {0x31C, 0x31E, UNMODELLED},
    {0x38C, 0x38E, UNMODELLED},
    {0x58C, 0x593, UNMODELLED},
    {R_TMR0L, R_T0CON1, TIMER},
    {0x60C, 0x614, UNMODELLED},
    {R_PIR0, R_PIR0 + 7, SYSTEM},
    {R_PIE0, R_PIE0 + 7, SYSTEM},
    {R_PMD0, R_PMD0 + 5, UNMODELLED},
    {R_WDTCON0, R_WDTTMR, SYSTEM},
    {R_BORCON, R_VREGCON, PLAIN},
    {R_PCON0, R_PCON1, PLAIN},
    {R_NVMADRL, R_NVMCON2, UNMODELLED},
    {R_CPUDOZE, R_CPUDOZE, PLAIN},
    {R_OSCCON1, R_OSCFRQ, SYSTEM},
    {0x895, 0x896, UNMODELLED},
    {R_FVRCON, R_FVRCON, UNMODELLED},
    {0x90E, 0x90F, UNMODELLED},
    {0x91F, 0x91F, UNMODELLED},
    {0x98F, 0x997, UNMODELLED},
    {0xA19, 0xA1F, UNMODELLED},
    {0x1E0F, 0x1E37, UNMODELLED},
    {R_PPSLOCK, R_PPSLOCK, SYSTEM},
    {0x1E90, 0x1E93, UNMODELLED},
    {0x1E9C, 0x1E9C, UNMODELLED},
    {0x1EA1, 0x1EA2, UNMODELLED},
    {0x1EB1, 0x1EB1, UNMODELLED},
    {0x1EBB, 0x1EBE, UNMODELLED},
    {0x1EC3, 0x1EC3, UNMODELLED},
    {R_SSP1CLKPPS, R_SSP2SSPPS, PORT},
    {R_RX1DTPPS, R_TX1CKPPS, PORT},
    {0x1ECD, 0x1ECE, UNMODELLED},
    {R_RA0PPS, 0x1F27, PORT},
    {R_ANSELA, R_ANSELA, PORT},
    {R_ANSELB, R_ANSELB, PORT},
    {R_ANSELC, R_ANSELC, PORT},
    /* pull-ups, open drain, slew rate, input level; interrupt on change is not modelled */
    {0x1F39, 0x1F39, PLAIN},
    {0x1F3A, 0x1F3A, PORT},
    {0x1F3B, 0x1F3C, PLAIN},
    {0x1F3D, 0x1F3F, UNMODELLED},
    {0x1F44, 0x1F44, PLAIN},
    {0x1F45, 0x1F45, PORT},
    {0x1F46, 0x1F47, PLAIN},
    {0x1F48, 0x1F4A, UNMODELLED},
    {0x1F4F, 0x1F4F, PLAIN},
    {0x1F50, 0x1F50, PORT},
    {0x1F51, 0x1F52, PLAIN},
    {0x1F53, 0x1F55, UNMODELLED},
    {0x1F65, 0x1F65, PLAIN},
    {0x1F68, 0x1F68, PLAIN},
    {0x1F69, 0x1F6B, UNMODELLED},
    {R_STATUS_SHAD, 0x1FEB, PLAIN},
    {R_STKPTR, R_TOSH, SYSTEM},
};

static uint8_t ram_kind(unsigned at)
{
    const unsigned f = at % BANK;
    if (f < R_CORE_END) {
        return CORE;
    }
    return f >= COMMON || (f >= GPR_FIRST && at < GPR_END_LAST_BANK) ? PLAIN : NOWHERE;
}

/* Most registers only do something when they are written. */
static bool reads_with_effect(const pic *p, unsigned at)
{
    switch (p->kind[at]) {
    case PLAIN:
    case ADC_UNIT:
        return false;
    case PORT:
        return at <= R_PORTE;
    case SSP:
        return at == R_SSP1BUF || at == R_SSP2BUF;
    case SYSTEM:
        return (at >= R_WDTPSL && at <= R_WDTTMR) || at >= R_STKPTR;
    default:
        return true;
    }
}

void pic_map_memory(pic *p)
{
    for (unsigned at = 0; at < PIC_DATA; ++at) {
        p->kind[at] = ram_kind(at);
    }
    for (size_t i = 0; i < sizeof REGISTERS / sizeof REGISTERS[0]; ++i) {
        memset(&p->kind[REGISTERS[i].first], REGISTERS[i].kind, (size_t)(REGISTERS[i].last - REGISTERS[i].first) + 1u);
    }
    for (unsigned at = 0; at < PIC_DATA; ++at) {
        p->look[at] = reads_with_effect(p, at);
    }
}
