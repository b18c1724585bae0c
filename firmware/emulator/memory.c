/* Data memory: 64 banks, the same bytes as linear memory for the FSRs, and who answers at each address. */
#include <stddef.h>
#include <string.h>

#include "parts.h"

enum { PLAIN = 0, CORE, NOWHERE, UNMODELLED, PORT, TIMER, SSP, ADC_UNIT, UART, SYSTEM };

#define BANK 0x80u
#define GPR_FIRST 0x20u
#define GPR_BYTES 80u
#define COMMON 0x70u
#define GPR_END_LAST_BANK 0x0CC0u /* bank 25 has 32 bytes only */
#define LINEAR 0x2000u
#define LINEAR_BYTES 2032u
#define FLASH 0x8000u

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

void pic_stray(pic *p, uint16_t address)
{
    ++p->strays[address];
    ++p->stray_total;
}

static uint8_t core_read(pic *p, unsigned f)
{
    switch (f) {
    case R_INDF0:
    case R_INDF1:
        return pic_read_far(p, p->fsr[f]);
    case R_PCL:
        return (uint8_t)p->pc;
    case R_STATUS:
        return p->status;
    case R_FSR0L:
    case R_FSR1L:
        return (uint8_t)p->fsr[(f - R_FSR0L) / 2u];
    case R_FSR0H:
    case R_FSR1H:
        return (uint8_t)(p->fsr[(f - R_FSR0L) / 2u] >> 8);
    case R_BSR:
        return p->bsr;
    case R_WREG:
        return p->w;
    case R_PCLATH:
        return p->pclath;
    default:
        return p->intcon;
    }
}

static void core_write(pic *p, unsigned f, uint8_t value)
{
    uint16_t *fsr = &p->fsr[f >= R_FSR1L ? 1 : 0];
    switch (f) {
    case R_INDF0:
    case R_INDF1:
        pic_write_far(p, p->fsr[f], value);
        break;
    case R_PCL:
        p->pc = (uint16_t)(((unsigned)(p->pclath & 0x7Fu) << 8 | value) & 0x3FFFu);
        ++p->cycles;
        break;
    case R_STATUS:
        p->status = (uint8_t)((p->status & (STATUS_TO | STATUS_PD)) | (value & 7u));
        break;
    case R_FSR0L:
    case R_FSR1L:
        *fsr = (uint16_t)((*fsr & 0xFF00u) | value);
        break;
    case R_FSR0H:
    case R_FSR1H:
        *fsr = (uint16_t)((*fsr & 0xFFu) | (unsigned)value << 8);
        break;
    case R_BSR:
        p->bsr = value & 0x3Fu;
        break;
    case R_WREG:
        p->w = value;
        break;
    case R_PCLATH:
        p->pclath = value & 0x7Fu;
        break;
    default:
        p->intcon = value & (INTCON_GIE | INTCON_PEIE | 1u);
        pic_look_at_interrupts(p);
        break;
    }
}

uint8_t pic_read(pic *p, uint16_t address)
{
    switch (p->kind[address]) {
    case CORE:
        return core_read(p, address % BANK);
    case PORT:
        return ports_read(p, address);
    case TIMER:
        return timers_read(p, address);
    case SSP:
        return ssp_read(p, address);
    case UART:
        return uart_read(p, address);
    case SYSTEM:
        return system_read(p, address);
    case NOWHERE:
        pic_stray(p, address);
        return 0;
    case UNMODELLED:
        pic_stray(p, address);
        return p->mem[address];
    default:
        return p->mem[address];
    }
}

void pic_write(pic *p, uint16_t address, uint8_t value)
{
    switch (p->kind[address]) {
    case CORE:
        core_write(p, address % BANK, value);
        break;
    case PORT:
        ports_write(p, address, value);
        break;
    case TIMER:
        timers_write(p, address, value);
        break;
    case SSP:
        ssp_write(p, address, value);
        break;
    case ADC_UNIT:
        adc_write(p, address, value);
        break;
    case UART:
        uart_write(p, address, value);
        break;
    case SYSTEM:
        system_write(p, address, value);
        break;
    case NOWHERE:
        pic_stray(p, address);
        break;
    case UNMODELLED:
        if (value != p->mem[address]) { /* writing what is there anyway changes nothing on the chip either */
            pic_stray(p, address);
        }
        p->mem[address] = value;
        break;
    default:
        p->mem[address] = value;
        break;
    }
}

static uint16_t near_address(uint16_t fsr)
{
    if (fsr >= LINEAR) {
        const unsigned at = (unsigned)fsr - LINEAR;
        return (uint16_t)(at / GPR_BYTES * BANK + GPR_FIRST + at % GPR_BYTES);
    }
    return fsr % BANK >= COMMON ? (uint16_t)(fsr % BANK) : fsr;
}

uint8_t pic_read_far(pic *p, uint16_t fsr)
{
    if (fsr >= FLASH) { /* low byte of a word; one cycle more */
        ++p->cycles;
        return (uint8_t)p->words[fsr % PIC_WORDS];
    }
    const uint16_t at = near_address(fsr);
    if (fsr >= LINEAR + LINEAR_BYTES || at % BANK <= R_INDF1) { /* INDF through an FSR reads 0 */
        pic_stray(p, at < PIC_DATA ? at : 0);
        return 0;
    }
    return p->kind[at] == PLAIN ? p->mem[at] : pic_read(p, at);
}

void pic_write_far(pic *p, uint16_t fsr, uint8_t value)
{
    const uint16_t at = fsr >= FLASH ? 0 : near_address(fsr);
    if (fsr >= LINEAR + LINEAR_BYTES || at % BANK <= R_INDF1) {
        pic_stray(p, at < PIC_DATA ? at : 0);
    } else if (p->kind[at] == PLAIN) {
        p->mem[at] = value;
    } else {
        pic_write(p, at, value);
    }
}
