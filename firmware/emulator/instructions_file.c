/* Instructions on a byte or a bit of a file register. */
#include "instructions.h"

static void add(pic *p, const pic_op *op, unsigned a, unsigned b, unsigned carry)
{
    uint8_t f = 0;
    const uint8_t value = sum(a, b, carry, &f);
    result(p, op, value);
    flags(p, STATUS_C | STATUS_DC | STATUS_Z, f);
}

/* byte-oriented */
void op_addwf(pic *p, const pic_op *op) { add(p, op, get(p, op), p->w, 0); }
void op_addwfc(pic *p, const pic_op *op) { add(p, op, get(p, op), p->w, p->status & STATUS_C); }
void op_subwf(pic *p, const pic_op *op) { add(p, op, get(p, op), (uint8_t)~p->w, 1); }
void op_subwfb(pic *p, const pic_op *op) { add(p, op, get(p, op), (uint8_t)~p->w, p->status & STATUS_C); }
void op_andwf(pic *p, const pic_op *op) { result_z(p, op, get(p, op) & p->w); }
void op_iorwf(pic *p, const pic_op *op) { result_z(p, op, get(p, op) | p->w); }
void op_xorwf(pic *p, const pic_op *op) { result_z(p, op, get(p, op) ^ p->w); }
void op_comf(pic *p, const pic_op *op) { result_z(p, op, (uint8_t)~get(p, op)); }
void op_decf(pic *p, const pic_op *op) { result_z(p, op, (uint8_t)(get(p, op) - 1u)); }
void op_incf(pic *p, const pic_op *op) { result_z(p, op, (uint8_t)(get(p, op) + 1u)); }
void op_movf(pic *p, const pic_op *op) { result_z(p, op, get(p, op)); }
void op_movwf(pic *p, const pic_op *op) { put(p, op, p->w); }

void op_swapf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    result(p, op, (uint8_t)(value << 4 | value >> 4));
}

void op_clrf(pic *p, const pic_op *op)
{
    put(p, op, 0);
    flags(p, STATUS_Z, STATUS_Z);
}

void op_clrw(pic *p, const pic_op *op)
{
    (void)op;
    p->w = 0;
    flags(p, STATUS_Z, STATUS_Z);
}

static void shifted(pic *p, const pic_op *op, uint8_t value, unsigned carry, uint8_t z)
{
    result(p, op, value);
    flags(p, (uint8_t)(STATUS_C | z), (uint8_t)((carry != 0 ? STATUS_C : 0u) | (z & zero(value))));
}

void op_rlf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value << 1 | (p->status & STATUS_C)), value & 0x80u, 0);
}

void op_rrf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value >> 1 | (p->status & STATUS_C) << 7), value & 1u, 0);
}

void op_lslf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value << 1), value & 0x80u, STATUS_Z);
}

void op_lsrf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, value >> 1, value & 1u, STATUS_Z);
}

void op_asrf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value >> 1 | (value & 0x80u)), value & 1u, STATUS_Z);
}

void op_decfsz(pic *p, const pic_op *op)
{
    const uint8_t value = (uint8_t)(get(p, op) - 1u);
    result(p, op, value);
    if (value == 0) {
        skip(p);
    }
}

void op_incfsz(pic *p, const pic_op *op)
{
    const uint8_t value = (uint8_t)(get(p, op) + 1u);
    result(p, op, value);
    if (value == 0) {
        skip(p);
    }
}

/* bit-oriented; BCF and BSF read, change and write */
void op_bcf(pic *p, const pic_op *op) { put(p, op, (uint8_t)(get(p, op) & (uint8_t)~op->bit)); }
void op_bsf(pic *p, const pic_op *op) { put(p, op, get(p, op) | op->bit); }

void op_btfsc(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) == 0) {
        skip(p);
    }
}

void op_btfss(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) != 0) {
        skip(p);
    }
}

/* Bounded waits are much of what drivers do:
 *
 *     again: BTFSx register, bit      5 cycles a round; nothing but an event can change the register,
 *            BRA out                  so the rounds until the next one are taken at once
 *            DECFSZ counter, F
 *            BRA again
 */
#define ROUND_CYCLES 5u

static void take_rounds(pic *p, const pic_op *op)
{
    const pic_op *count = op + 2;
    uint8_t *counter = count->k == R_WREG ? &p->w : &p->mem[here(p, count)];
    const bool plain = count->k == R_WREG || p->kind[here(p, count)] == 0;
    if (!plain || p->look[here(p, op)] || p->next_event <= p->cycles) {
        return;
    }
    const uint64_t until_event = (p->next_event - p->cycles) / ROUND_CYCLES;
    const uint8_t but_one = (uint8_t)(*counter - 1u); /* the last round is done word by word; 0 counts as 256 */
    const uint8_t rounds = until_event < but_one ? (uint8_t)until_event : but_one;
    *counter = (uint8_t)(*counter - rounds);
    p->cycles += (uint64_t)rounds * ROUND_CYCLES;
}

void op_wait_while_set(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) != 0) {
        take_rounds(p, op);
        skip(p);
    }
}

void op_wait_while_clear(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) == 0) {
        take_rounds(p, op);
        skip(p);
    }
}
