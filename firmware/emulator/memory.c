/* Data memory: 64 banks, and the same bytes as linear memory for the FSRs. */
#include "memory_map.h"
#include "parts.h"

#define GPR_BYTES 80u
#define LINEAR 0x2000u
#define LINEAR_BYTES 2032u
#define FLASH 0x8000u

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
