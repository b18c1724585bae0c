/* Instructions on literals and FSRs, those that steer the program, and the stack. */
#include <stddef.h>

#include "instructions.h"

void pic_push(pic *p, uint16_t target)
{
    p->stkptr = (uint8_t)((p->stkptr + 1u) & 0x1Fu);
    if (p->stkptr >= PIC_STACK) {
        pic_reset(p, RESET_BY_OVERFLOW);
        return;
    }
    p->stack[p->stkptr] = p->pc;
    p->pc = (uint16_t)(target & PC_MASK);
    if (p->stkptr >= p->deepest) {
        p->deepest = (uint8_t)(p->stkptr + 1u);
    }
    if (p->watch.call != NULL) {
        p->watch.call(p->watch.context, p->pc);
    }
}

/* False: there was nothing on the stack, and the chip is reset. */
static bool pop(pic *p)
{
    if (p->stkptr >= PIC_STACK) {
        pic_reset(p, RESET_BY_UNDERFLOW);
        return false;
    }
    p->pc = p->stack[p->stkptr];
    p->stkptr = (uint8_t)((p->stkptr - 1u) & 0x1Fu);
    ++p->cycles;
    if (p->watch.leave != NULL) {
        p->watch.leave(p->watch.context);
    }
    return true;
}

static void call_to(pic *p, unsigned target)
{
    ++p->cycles;
    pic_push(p, (uint16_t)(target & PC_MASK));
}

static void add_w(pic *p, unsigned a, unsigned b, unsigned carry)
{
    uint8_t f = 0;
    p->w = sum(a, b, carry, &f);
    flags(p, STATUS_C | STATUS_DC | STATUS_Z, f);
}

/* literals */
void op_addlw(pic *p, const pic_op *op) { add_w(p, op->k, p->w, 0); }
void op_sublw(pic *p, const pic_op *op) { add_w(p, op->k, (uint8_t)~p->w, 1); }
void op_movlw(pic *p, const pic_op *op) { p->w = (uint8_t)op->k; }
void op_movlb(pic *p, const pic_op *op) { p->bsr = (uint8_t)op->k; }
void op_movlp(pic *p, const pic_op *op) { p->pclath = (uint8_t)op->k; }

void op_andlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)(p->w & op->k);
    flags(p, STATUS_Z, zero(p->w));
}

void op_iorlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)(p->w | op->k);
    flags(p, STATUS_Z, zero(p->w));
}

void op_xorlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)(p->w ^ op->k);
    flags(p, STATUS_Z, zero(p->w));
}

/* control */
void op_goto(pic *p, const pic_op *op) { go(p, (unsigned)(p->pclath & 0x78u) << 8 | op->k); }
void op_call(pic *p, const pic_op *op) { call_to(p, (unsigned)(p->pclath & 0x78u) << 8 | op->k); }
void op_bra(pic *p, const pic_op *op) { go(p, (unsigned)p->pc + op->k); } /* k has its sign in 16 bits */

void op_brw(pic *p, const pic_op *op)
{
    (void)op;
    go(p, (unsigned)p->pc + p->w);
}

void op_callw(pic *p, const pic_op *op)
{
    (void)op;
    call_to(p, (unsigned)(p->pclath & 0x7Fu) << 8 | p->w);
}

void op_return(pic *p, const pic_op *op)
{
    (void)op;
    (void)pop(p);
}

void op_retlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)op->k;
    (void)pop(p);
}

void op_retfie(pic *p, const pic_op *op)
{
    (void)op;
    if (!pop(p)) {
        return;
    }
    const uint8_t *shadow = &p->mem[R_STATUS_SHAD];
    p->status = (uint8_t)((p->status & (STATUS_TO | STATUS_PD)) | (shadow[0] & 7u));
    p->w = shadow[1];
    p->bsr = shadow[2] & 0x3Fu;
    p->pclath = shadow[3] & 0x7Fu;
    p->fsr[0] = (uint16_t)(shadow[4] | shadow[5] << 8);
    p->fsr[1] = (uint16_t)(shadow[6] | shadow[7] << 8);
    p->intcon |= INTCON_GIE;
    pic_look_at_interrupts(p);
}

void op_nop(pic *p, const pic_op *op)
{
    (void)p;
    (void)op;
}

void op_reset(pic *p, const pic_op *op)
{
    (void)op;
    pic_reset(p, RESET_BY_INSTRUCTION);
}

void op_clrwdt(pic *p, const pic_op *op)
{
    (void)op;
    pic_clear_wdt(p);
}

void op_sleep(pic *p, const pic_op *op)
{
    (void)op;
    pic_sleep(p);
}

void op_option(pic *p, const pic_op *op) /* OPTION_REG is gone on this chip; TRIS f is left */
{
    (void)op;
    ++p->bad_opcodes;
}

void op_tris(pic *p, const pic_op *op) { pic_write(p, (uint16_t)(R_TRISA + op->k - 5u), p->w); }

/* through a FSR */
void op_addfsr(pic *p, const pic_op *op) { p->fsr[op->n] = (uint16_t)(p->fsr[op->n] + op->k); }

enum { PRE_INCREMENT, PRE_DECREMENT, POST_INCREMENT, POST_DECREMENT };

static uint16_t step_before(pic *p, const pic_op *op)
{
    uint16_t *fsr = &p->fsr[op->n];
    *fsr = (uint16_t)(*fsr + (op->bit == PRE_INCREMENT ? 1u : op->bit == PRE_DECREMENT ? 0xFFFFu : 0u));
    return *fsr;
}

static void step_after(pic *p, const pic_op *op)
{
    uint16_t *fsr = &p->fsr[op->n];
    *fsr = (uint16_t)(*fsr + (op->bit == POST_INCREMENT ? 1u : op->bit == POST_DECREMENT ? 0xFFFFu : 0u));
}

static void moviw(pic *p, uint16_t from)
{
    p->w = pic_read_far(p, from);
    flags(p, STATUS_Z, zero(p->w));
}

void op_moviw(pic *p, const pic_op *op)
{
    moviw(p, step_before(p, op));
    step_after(p, op);
}

void op_movwi(pic *p, const pic_op *op)
{
    pic_write_far(p, step_before(p, op), p->w);
    step_after(p, op);
}

void op_moviw_k(pic *p, const pic_op *op) { moviw(p, (uint16_t)(p->fsr[op->n] + op->k)); }
void op_movwi_k(pic *p, const pic_op *op) { pic_write_far(p, (uint16_t)(p->fsr[op->n] + op->k), p->w); }

void op_unknown(pic *p, const pic_op *op)
{
    (void)op;
    ++p->bad_opcodes;
}
