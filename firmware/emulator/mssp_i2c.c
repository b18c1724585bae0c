/* MSSP1 as I2C master. One clock lasts SSP1ADD + 1 cycles; START, STOP and the others last the halves that the data
 * sheet's figures show. A slave that holds SCL makes it all later; a SDA that is held low where the chip wants it high
 * is a bus collision. */
#include "outside.h"
#include "parts.h"

#define BITS_AND_ACK 9u
#define SCL_PIN (PIN_RC0 + 3u)
#define SDA_PIN (PIN_RC0 + 4u)
#define LEAST_ADD 3u

/* Pins as the board's wiring wants them: else nobody hears us. */
static bool is_wired(const pic *p)
{
    return ports_routes_out(p, SCL_PIN, PPS_SCL1) && ports_routes_out(p, SDA_PIN, PPS_SDA1) &&
           p->mem[R_SSP1CLKPPS] == SCL_PIN && p->mem[R_SSP1DATPPS] == SDA_PIN && ports_is_digital_input(p, SCL_PIN) &&
           ports_is_digital_input(p, SDA_PIN);
}

static uint64_t half_clocks(const pic *p, unsigned halves)
{
    const unsigned add = p->mem[R_SSP1ADD];
    return ((uint64_t)(add < LEAST_ADD ? LEAST_ADD : add) + 1u) * halves / 2u;
}

static unsigned halves_of(ssp_activity what)
{
    switch (what) {
    case SSP_START:
    case SSP_ACK:
        return 2;
    case SSP_RESTART:
    case SSP_STOP:
        return 3;
    case SSP_RECEIVE:
        return 2u * (BITS_AND_ACK - 1u);
    default:
        return 2u * BITS_AND_ACK;
    }
}

void i2c_begin(pic *p, ssp_activity what)
{
    pic_ssp *ssp = &p->ssp[0];
    uint8_t *stat = &p->mem[R_SSP1STAT];
    if (!is_wired(p) || (what != SSP_START && !ssp->has_bus)) {
        ++p->bus_misuse;
    }
    ssp->doing = what;
    if (what == SSP_SEND) {
        ssp->shift = p->mem[R_SSP1BUF];
        *stat |= SSP_BF | SSP_RW;
    } else if (what == SSP_RECEIVE && (*stat & SSP_BF) != 0) {
        p->mem[R_SSP1CON1] |= SSP_OV;
    } else {
        /* nothing to keep */
    }
    uint64_t from = p->cycles;
    const uint64_t held = outside_scl_held(p->outside, pic_ns(p));
    if (held == PIC_NEVER) {
        return; /* the clock never comes back: no end */
    }
    if (held != 0) {
        const uint64_t until = pic_cycles_at(p, held);
        from = until > from ? until : from;
    }
    pic_at(p, EVENT_SSP1, from + half_clocks(p, halves_of(what)));
}

static void collide(pic *p)
{
    p->mem[R_SSP1CON2] &= (uint8_t) ~(SSP_SEN | SSP_RSEN | SSP_PEN | SSP_RCEN | SSP_ACKEN);
    p->mem[R_SSP1STAT] &= (uint8_t) ~(SSP_BF | SSP_RW);
    p->ssp[0].has_bus = false;
    pic_flag(p, 3, PIR3_BCL1);
}

static void finish_send(pic *p, bool held, uint64_t ns)
{
    uint8_t *con2 = &p->mem[R_SSP1CON2];
    p->mem[R_SSP1STAT] &= (uint8_t) ~(SSP_BF | SSP_RW);
    if (held && p->ssp[0].shift != 0) { /* wanted a 1 */
        collide(p);
        return;
    }
    const bool ack = is_wired(p) && outside_i2c_send(p->outside, p->ssp[0].shift, ns);
    *con2 = (uint8_t)((*con2 & (uint8_t)~SSP_ACKSTAT) | (ack || held ? 0u : SSP_ACKSTAT));
}

static void finish_receive(pic *p, bool held, uint64_t ns)
{
    p->mem[R_SSP1CON2] &= (uint8_t)~SSP_RCEN;
    const uint8_t byte = is_wired(p) ? outside_i2c_receive(p->outside, ns) : 0xFFu;
    if ((p->mem[R_SSP1CON1] & SSP_OV) == 0) {
        p->mem[R_SSP1BUF] = held ? 0 : byte;
    }
    p->mem[R_SSP1STAT] |= SSP_BF;
}

static void finish_edge(pic *p, ssp_activity was, bool held, uint64_t ns)
{
    uint8_t *stat = &p->mem[R_SSP1STAT];
    const bool begin = was != SSP_STOP;
    p->mem[R_SSP1CON2] &= (uint8_t) ~(SSP_SEN | SSP_RSEN | SSP_PEN);
    if (held) {
        collide(p);
        return;
    }
    *stat = (uint8_t)((*stat & (uint8_t) ~(SSP_S | SSP_P)) | (begin ? SSP_S : SSP_P));
    p->ssp[0].has_bus = begin;
    if (begin) {
        outside_i2c_start(p->outside, ns);
    } else {
        outside_i2c_stop(p->outside, ns);
    }
}

void i2c_end(pic *p)
{
    const ssp_activity was = p->ssp[0].doing;
    const uint64_t ns = pic_ns(p);
    const bool held = outside_sda_held(p->outside, ns);
    p->ssp[0].doing = SSP_IDLE;
    switch (was) {
    case SSP_SEND:
        finish_send(p, held, ns);
        break;
    case SSP_RECEIVE:
        finish_receive(p, held, ns);
        break;
    case SSP_ACK:
        p->mem[R_SSP1CON2] &= (uint8_t)~SSP_ACKEN;
        outside_i2c_acknowledge(p->outside, (p->mem[R_SSP1CON2] & SSP_ACKDT) == 0);
        break;
    case SSP_START:
    case SSP_RESTART:
    case SSP_STOP:
        finish_edge(p, was, held, ns);
        break;
    case SSP_IDLE:
    case SSP_SPI:
    default:
        return;
    }
    if ((p->mem[R_PIR0 + 3] & PIR3_BCL1) == 0 || !held) {
        pic_flag(p, 3, PIR3_SSP1);
    }
}
