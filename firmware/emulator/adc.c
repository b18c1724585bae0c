/* The 10-bit ADC: 11.5 TAD a conversion; counts what the data sheet does not allow. */
#include "outside.h"
#include "parts.h"

#define TAD_HALVES 23u /* 11.5 TAD */
#define LEAST_TAD_NS 1000u
#define LEAST_ACQUISITION_NS 2000u /* 1 kohm source; the data sheet's formula gives 4.6 us for 10 kohm */
#define ADFM_RIGHT 0x80u
#define FRC_NS 2000u

static uint32_t tad_ns(const pic *p)
{
    static const uint8_t DIVIDER[8] = {2, 8, 32, 0, 4, 16, 64, 0};
    const unsigned divider = DIVIDER[(p->mem[R_ADCON1] >> 4) & 7u];
    return divider == 0 ? FRC_NS : p->cycle_ns * divider / 4u;
}

static void start(pic *p)
{
    const uint32_t tad = tad_ns(p);
    const uint64_t since = (p->cycles - p->channel_since) * p->cycle_ns;
    if (tad < LEAST_TAD_NS || since < LEAST_ACQUISITION_NS) {
        ++p->adc_rushed;
    }
    pic_at(p, EVENT_ADC, p->cycles + ((uint64_t)tad * TAD_HALVES / 2u + p->cycle_ns - 1u) / p->cycle_ns);
}

void adc_write(pic *p, uint16_t address, uint8_t value)
{
    const uint8_t before = p->mem[address];
    p->mem[address] = value;
    if (address != R_ADCON0) {
        return;
    }
    if ((before & 0xFCu) != (value & 0xFCu) || (before & ADCON0_ADON) == 0) {
        p->channel_since = p->cycles;
    }
    if ((value & ADCON0_ADON) == 0) {
        p->mem[R_ADCON0] &= (uint8_t)~ADCON0_GO;
        p->events[EVENT_ADC] = PIC_NEVER;
    } else if ((value & ADCON0_GO) != 0 && (before & ADCON0_GO) == 0) {
        start(p);
    } else {
        /* only the channel, or GO again while it converts */
    }
}

void adc_event(pic *p)
{
    const unsigned code = outside_adc(p->outside, p->mem[R_ADCON0] >> 2, pic_ns(p)) & 0x3FFu;
    const unsigned shown = (p->mem[R_ADCON1] & ADFM_RIGHT) != 0 ? code : code << 6;
    p->mem[R_ADRESL] = (uint8_t)shown;
    p->mem[R_ADRESH] = (uint8_t)(shown >> 8);
    p->mem[R_ADCON0] &= (uint8_t)~ADCON0_GO;
    pic_flag(p, 1, PIR1_AD);
}
