/* What the instructions share, and the instructions themselves: each is a function of the decoded word. */
#ifndef GSENSE_EMULATOR_INSTRUCTIONS_H
#define GSENSE_EMULATOR_INSTRUCTIONS_H

#include "parts.h"

#define PC_MASK 0x3FFFu
#define SUM_CARRY 0x100u
#define ROUND_WORDS 4u /* of a bounded wait: instructions_file.c */

static inline uint16_t here(const pic *p, const pic_op *op)
{
    return op->k >= 0x70u ? op->k : (uint16_t)((unsigned)p->bsr << 7 | op->k);
}

static inline uint8_t get(pic *p, const pic_op *op)
{
    const uint16_t at = here(p, op);
    return p->look[at] ? pic_read(p, at) : p->mem[at];
}

static inline void put(pic *p, const pic_op *op, uint8_t value)
{
    const uint16_t at = here(p, op);
    if (p->kind[at] == 0) {
        p->mem[at] = value;
    } else {
        pic_write(p, at, value);
    }
}

static inline void result(pic *p, const pic_op *op, uint8_t value)
{
    if (op->bit != 0) {
        put(p, op, value);
    } else {
        p->w = value;
    }
}

static inline void flags(pic *p, uint8_t mask, uint8_t value)
{
    p->status = (uint8_t)((p->status & (uint8_t)~mask) | value);
}

static inline uint8_t zero(uint8_t value) { return value == 0 ? STATUS_Z : 0; }

/* The flags come after the write: with STATUS as the destination they win. */
static inline void result_z(pic *p, const pic_op *op, uint8_t value)
{
    result(p, op, value);
    flags(p, STATUS_Z, zero(value));
}

static inline uint8_t sum(unsigned a, unsigned b, unsigned carry, uint8_t *new_flags)
{
    const unsigned whole = a + b + carry;
    const unsigned low = (a & 15u) + (b & 15u) + carry;
    *new_flags = (uint8_t)((whole >= SUM_CARRY ? STATUS_C : 0u) | (low > 15u ? STATUS_DC : 0u) | zero((uint8_t)whole));
    return (uint8_t)whole;
}

static inline void go(pic *p, unsigned to)
{
    p->pc = (uint16_t)(to & PC_MASK);
    ++p->cycles;
}

static inline void skip(pic *p)
{
    p->pc = (uint16_t)((p->pc + 1u) & PC_MASK);
    ++p->cycles;
}

/* instructions_file.c, instructions_control.c */
void op_addwf(pic *p, const pic_op *op);
void op_addwfc(pic *p, const pic_op *op);
void op_subwf(pic *p, const pic_op *op);
void op_subwfb(pic *p, const pic_op *op);
void op_andwf(pic *p, const pic_op *op);
void op_iorwf(pic *p, const pic_op *op);
void op_xorwf(pic *p, const pic_op *op);
void op_comf(pic *p, const pic_op *op);
void op_decf(pic *p, const pic_op *op);
void op_incf(pic *p, const pic_op *op);
void op_movf(pic *p, const pic_op *op);
void op_movwf(pic *p, const pic_op *op);
void op_swapf(pic *p, const pic_op *op);
void op_clrf(pic *p, const pic_op *op);
void op_clrw(pic *p, const pic_op *op);
void op_rlf(pic *p, const pic_op *op);
void op_rrf(pic *p, const pic_op *op);
void op_lslf(pic *p, const pic_op *op);
void op_lsrf(pic *p, const pic_op *op);
void op_asrf(pic *p, const pic_op *op);
void op_decfsz(pic *p, const pic_op *op);
void op_incfsz(pic *p, const pic_op *op);
void op_bcf(pic *p, const pic_op *op);
void op_bsf(pic *p, const pic_op *op);
void op_btfsc(pic *p, const pic_op *op);
void op_btfss(pic *p, const pic_op *op);
void op_wait_while_set(pic *p, const pic_op *op);
void op_wait_while_clear(pic *p, const pic_op *op);
void op_addlw(pic *p, const pic_op *op);
void op_sublw(pic *p, const pic_op *op);
void op_movlw(pic *p, const pic_op *op);
void op_movlb(pic *p, const pic_op *op);
void op_movlp(pic *p, const pic_op *op);
void op_andlw(pic *p, const pic_op *op);
void op_iorlw(pic *p, const pic_op *op);
void op_xorlw(pic *p, const pic_op *op);
void op_goto(pic *p, const pic_op *op);
void op_call(pic *p, const pic_op *op);
void op_bra(pic *p, const pic_op *op);
void op_brw(pic *p, const pic_op *op);
void op_callw(pic *p, const pic_op *op);
void op_return(pic *p, const pic_op *op);
void op_retlw(pic *p, const pic_op *op);
void op_retfie(pic *p, const pic_op *op);
void op_nop(pic *p, const pic_op *op);
void op_reset(pic *p, const pic_op *op);
void op_clrwdt(pic *p, const pic_op *op);
void op_sleep(pic *p, const pic_op *op);
void op_option(pic *p, const pic_op *op);
void op_tris(pic *p, const pic_op *op);
void op_addfsr(pic *p, const pic_op *op);
void op_moviw(pic *p, const pic_op *op);
void op_movwi(pic *p, const pic_op *op);
void op_moviw_k(pic *p, const pic_op *op);
void op_movwi_k(pic *p, const pic_op *op);
void op_unknown(pic *p, const pic_op *op);

#endif
