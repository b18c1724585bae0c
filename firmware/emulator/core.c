/* The enhanced mid-range core: 49 instructions, each a function; flash is decoded once. */
#include <stddef.h>

#include "parts.h"

#define PC_MASK 0x3FFFu
#define SUM_CARRY 0x100u

static uint16_t here(const pic *p, const pic_op *op)
{
    return op->k >= 0x70u ? op->k : (uint16_t)((unsigned)p->bsr << 7 | op->k);
}

static uint8_t get(pic *p, const pic_op *op)
{
    const uint16_t at = here(p, op);
    return p->look[at] ? pic_read(p, at) : p->mem[at];
}

static void put(pic *p, const pic_op *op, uint8_t value)
{
    const uint16_t at = here(p, op);
    if (p->kind[at] == 0) {
        p->mem[at] = value;
    } else {
        pic_write(p, at, value);
    }
}

static void result(pic *p, const pic_op *op, uint8_t value)
{
    if (op->bit != 0) {
        put(p, op, value);
    } else {
        p->w = value;
    }
}

static void flags(pic *p, uint8_t mask, uint8_t value) { p->status = (uint8_t)((p->status & (uint8_t)~mask) | value); }

static uint8_t zero(uint8_t value) { return value == 0 ? STATUS_Z : 0; }

/* The flags come after the write: with STATUS as the destination they win. */
static void result_z(pic *p, const pic_op *op, uint8_t value)
{
    result(p, op, value);
    flags(p, STATUS_Z, zero(value));
}

static uint8_t sum(pic *p, unsigned a, unsigned b, unsigned carry, uint8_t *new_flags)
{
    (void)p;
    const unsigned whole = a + b + carry;
    const unsigned low = (a & 15u) + (b & 15u) + carry;
    *new_flags = (uint8_t)((whole >= SUM_CARRY ? STATUS_C : 0u) | (low > 15u ? STATUS_DC : 0u) | zero((uint8_t)whole));
    return (uint8_t)whole;
}

static void add(pic *p, const pic_op *op, unsigned a, unsigned b, unsigned carry)
{
    uint8_t f = 0;
    const uint8_t value = sum(p, a, b, carry, &f);
    result(p, op, value);
    flags(p, STATUS_C | STATUS_DC | STATUS_Z, f);
}

static void add_w(pic *p, unsigned a, unsigned b, unsigned carry)
{
    uint8_t f = 0;
    p->w = sum(p, a, b, carry, &f);
    flags(p, STATUS_C | STATUS_DC | STATUS_Z, f);
}

static void go(pic *p, unsigned to)
{
    p->pc = (uint16_t)(to & PC_MASK);
    ++p->cycles;
}

static void skip(pic *p)
{
    p->pc = (uint16_t)((p->pc + 1u) & PC_MASK);
    ++p->cycles;
}

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

/* byte-oriented */
static void op_addwf(pic *p, const pic_op *op) { add(p, op, get(p, op), p->w, 0); }
static void op_addwfc(pic *p, const pic_op *op) { add(p, op, get(p, op), p->w, p->status & STATUS_C); }
static void op_subwf(pic *p, const pic_op *op) { add(p, op, get(p, op), (uint8_t)~p->w, 1); }
static void op_subwfb(pic *p, const pic_op *op) { add(p, op, get(p, op), (uint8_t)~p->w, p->status & STATUS_C); }
static void op_andwf(pic *p, const pic_op *op) { result_z(p, op, get(p, op) & p->w); }
static void op_iorwf(pic *p, const pic_op *op) { result_z(p, op, get(p, op) | p->w); }
static void op_xorwf(pic *p, const pic_op *op) { result_z(p, op, get(p, op) ^ p->w); }
static void op_comf(pic *p, const pic_op *op) { result_z(p, op, (uint8_t)~get(p, op)); }
static void op_decf(pic *p, const pic_op *op) { result_z(p, op, (uint8_t)(get(p, op) - 1u)); }
static void op_incf(pic *p, const pic_op *op) { result_z(p, op, (uint8_t)(get(p, op) + 1u)); }
static void op_movf(pic *p, const pic_op *op) { result_z(p, op, get(p, op)); }
static void op_movwf(pic *p, const pic_op *op) { put(p, op, p->w); }

static void op_swapf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    result(p, op, (uint8_t)(value << 4 | value >> 4));
}

static void op_clrf(pic *p, const pic_op *op)
{
    put(p, op, 0);
    flags(p, STATUS_Z, STATUS_Z);
}

static void op_clrw(pic *p, const pic_op *op)
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

static void op_rlf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value << 1 | (p->status & STATUS_C)), value & 0x80u, 0);
}

static void op_rrf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value >> 1 | (p->status & STATUS_C) << 7), value & 1u, 0);
}

static void op_lslf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value << 1), value & 0x80u, STATUS_Z);
}

static void op_lsrf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, value >> 1, value & 1u, STATUS_Z);
}

static void op_asrf(pic *p, const pic_op *op)
{
    const uint8_t value = get(p, op);
    shifted(p, op, (uint8_t)(value >> 1 | (value & 0x80u)), value & 1u, STATUS_Z);
}

static void op_decfsz(pic *p, const pic_op *op)
{
    const uint8_t value = (uint8_t)(get(p, op) - 1u);
    result(p, op, value);
    if (value == 0) {
        skip(p);
    }
}

static void op_incfsz(pic *p, const pic_op *op)
{
    const uint8_t value = (uint8_t)(get(p, op) + 1u);
    result(p, op, value);
    if (value == 0) {
        skip(p);
    }
}

/* bit-oriented; BCF and BSF read, change and write */
static void op_bcf(pic *p, const pic_op *op) { put(p, op, (uint8_t)(get(p, op) & (uint8_t)~op->bit)); }
static void op_bsf(pic *p, const pic_op *op) { put(p, op, get(p, op) | op->bit); }

static void op_btfsc(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) == 0) {
        skip(p);
    }
}

static void op_btfss(pic *p, const pic_op *op)
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
#define ROUND_WORDS 4u

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

static void op_wait_while_set(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) != 0) {
        take_rounds(p, op);
        skip(p);
    }
}

static void op_wait_while_clear(pic *p, const pic_op *op)
{
    if ((get(p, op) & op->bit) == 0) {
        take_rounds(p, op);
        skip(p);
    }
}

/* literals */
static void op_addlw(pic *p, const pic_op *op) { add_w(p, op->k, p->w, 0); }
static void op_sublw(pic *p, const pic_op *op) { add_w(p, op->k, (uint8_t)~p->w, 1); }
static void op_movlw(pic *p, const pic_op *op) { p->w = (uint8_t)op->k; }
static void op_movlb(pic *p, const pic_op *op) { p->bsr = (uint8_t)op->k; }
static void op_movlp(pic *p, const pic_op *op) { p->pclath = (uint8_t)op->k; }

static void op_andlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)(p->w & op->k);
    flags(p, STATUS_Z, zero(p->w));
}

static void op_iorlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)(p->w | op->k);
    flags(p, STATUS_Z, zero(p->w));
}

static void op_xorlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)(p->w ^ op->k);
    flags(p, STATUS_Z, zero(p->w));
}

/* control */
static void op_goto(pic *p, const pic_op *op) { go(p, (unsigned)(p->pclath & 0x78u) << 8 | op->k); }
static void op_call(pic *p, const pic_op *op) { call_to(p, (unsigned)(p->pclath & 0x78u) << 8 | op->k); }
static void op_bra(pic *p, const pic_op *op) { go(p, (unsigned)p->pc + op->k); } /* k has its sign in 16 bits */

static void op_brw(pic *p, const pic_op *op)
{
    (void)op;
    go(p, (unsigned)p->pc + p->w);
}

static void op_callw(pic *p, const pic_op *op)
{
    (void)op;
    call_to(p, (unsigned)(p->pclath & 0x7Fu) << 8 | p->w);
}

static void op_return(pic *p, const pic_op *op)
{
    (void)op;
    (void)pop(p);
}

static void op_retlw(pic *p, const pic_op *op)
{
    p->w = (uint8_t)op->k;
    (void)pop(p);
}

static void op_retfie(pic *p, const pic_op *op)
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

static void op_nop(pic *p, const pic_op *op)
{
    (void)p;
    (void)op;
}

static void op_reset(pic *p, const pic_op *op)
{
    (void)op;
    pic_reset(p, RESET_BY_INSTRUCTION);
}

static void op_clrwdt(pic *p, const pic_op *op)
{
    (void)op;
    pic_clear_wdt(p);
}

static void op_sleep(pic *p, const pic_op *op)
{
    (void)op;
    pic_sleep(p);
}

static void op_option(pic *p, const pic_op *op) /* OPTION_REG is gone on this chip; TRIS f is left */
{
    (void)op;
    ++p->bad_opcodes;
}

static void op_tris(pic *p, const pic_op *op) { pic_write(p, (uint16_t)(R_TRISA + op->k - 5u), p->w); }

/* through a FSR */
static void op_addfsr(pic *p, const pic_op *op) { p->fsr[op->n] = (uint16_t)(p->fsr[op->n] + op->k); }

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

static void op_moviw(pic *p, const pic_op *op)
{
    moviw(p, step_before(p, op));
    step_after(p, op);
}

static void op_movwi(pic *p, const pic_op *op)
{
    pic_write_far(p, step_before(p, op), p->w);
    step_after(p, op);
}

static void op_moviw_k(pic *p, const pic_op *op) { moviw(p, (uint16_t)(p->fsr[op->n] + op->k)); }
static void op_movwi_k(pic *p, const pic_op *op) { pic_write_far(p, (uint16_t)(p->fsr[op->n] + op->k), p->w); }

static void op_unknown(pic *p, const pic_op *op)
{
    (void)op;
    ++p->bad_opcodes;
}

typedef struct {
    uint16_t mask;
    uint16_t word;
    void (*run)(pic *p, const pic_op *op);
    enum {
        NONE,
        FILE_D,
        FILE_ONLY,
        FILE_BIT,
        LITERAL_8,
        LITERAL_6,
        LITERAL_7,
        LITERAL_11,
        RELATIVE_9,
        FSR_MODE,
        FSR_6,
        TRIS_3
    } shape;
} encoding;

/* first match counts */
static const encoding ENCODINGS[] = {
    {0x3FFF, 0x0000, op_nop, NONE},        {0x3FFF, 0x0001, op_reset, NONE},      {0x3FFF, 0x0008, op_return, NONE},
    {0x3FFF, 0x0009, op_retfie, NONE},     {0x3FFF, 0x000A, op_callw, NONE},      {0x3FFF, 0x000B, op_brw, NONE},
    {0x3FF8, 0x0010, op_moviw, FSR_MODE},  {0x3FF8, 0x0018, op_movwi, FSR_MODE},  {0x3FFF, 0x0062, op_option, NONE},
    {0x3FFF, 0x0063, op_sleep, NONE},      {0x3FFF, 0x0064, op_clrwdt, NONE},     {0x3FFF, 0x0065, op_tris, TRIS_3},
    {0x3FFE, 0x0066, op_tris, TRIS_3},     {0x3F80, 0x0080, op_movwf, FILE_ONLY}, {0x3FFC, 0x0100, op_clrw, NONE},
    {0x3FC0, 0x0140, op_movlb, LITERAL_6}, {0x3F80, 0x0180, op_clrf, FILE_ONLY},  {0x3F00, 0x0200, op_subwf, FILE_D},
    {0x3F00, 0x0300, op_decf, FILE_D},     {0x3F00, 0x0400, op_iorwf, FILE_D},    {0x3F00, 0x0500, op_andwf, FILE_D},
    {0x3F00, 0x0600, op_xorwf, FILE_D},    {0x3F00, 0x0700, op_addwf, FILE_D},    {0x3F00, 0x0800, op_movf, FILE_D},
    {0x3F00, 0x0900, op_comf, FILE_D},     {0x3F00, 0x0A00, op_incf, FILE_D},     {0x3F00, 0x0B00, op_decfsz, FILE_D},
    {0x3F00, 0x0C00, op_rrf, FILE_D},      {0x3F00, 0x0D00, op_rlf, FILE_D},      {0x3F00, 0x0E00, op_swapf, FILE_D},
    {0x3F00, 0x0F00, op_incfsz, FILE_D},   {0x3C00, 0x1000, op_bcf, FILE_BIT},    {0x3C00, 0x1400, op_bsf, FILE_BIT},
    {0x3C00, 0x1800, op_btfsc, FILE_BIT},  {0x3C00, 0x1C00, op_btfss, FILE_BIT},  {0x3800, 0x2000, op_call, LITERAL_11},
    {0x3800, 0x2800, op_goto, LITERAL_11}, {0x3F00, 0x3000, op_movlw, LITERAL_8}, {0x3F80, 0x3100, op_addfsr, FSR_6},
    {0x3F80, 0x3180, op_movlp, LITERAL_7}, {0x3E00, 0x3200, op_bra, RELATIVE_9},  {0x3F00, 0x3400, op_retlw, LITERAL_8},
    {0x3F00, 0x3500, op_lslf, FILE_D},     {0x3F00, 0x3600, op_lsrf, FILE_D},     {0x3F00, 0x3700, op_asrf, FILE_D},
    {0x3F00, 0x3800, op_iorlw, LITERAL_8}, {0x3F00, 0x3900, op_andlw, LITERAL_8}, {0x3F00, 0x3A00, op_xorlw, LITERAL_8},
    {0x3F00, 0x3B00, op_subwfb, FILE_D},   {0x3F00, 0x3C00, op_sublw, LITERAL_8}, {0x3F00, 0x3D00, op_addwfc, FILE_D},
    {0x3F00, 0x3E00, op_addlw, LITERAL_8}, {0x3F80, 0x3F00, op_moviw_k, FSR_6},   {0x3F80, 0x3F80, op_movwi_k, FSR_6},
    {0x0000, 0x0000, op_unknown, NONE},
};

static uint16_t extended(uint16_t value, uint16_t sign) { return (uint16_t)((value ^ sign) - sign); }

static void operands(pic_op *op, const encoding *e, uint16_t word)
{
    switch (e->shape) {
    case FILE_D:
    case FILE_ONLY:
        op->k = word & 0x7Fu;
        op->bit = (uint8_t)((word >> 7) & 1u);
        break;
    case FILE_BIT:
        op->k = word & 0x7Fu;
        op->bit = (uint8_t)(1u << ((word >> 7) & 7u));
        break;
    case FSR_MODE:
        op->n = (uint8_t)((word >> 2) & 1u);
        op->bit = word & 3u;
        break;
    case FSR_6:
        op->n = (uint8_t)((word >> 6) & 1u);
        op->k = extended(word & 0x3Fu, 0x20u);
        break;
    case RELATIVE_9:
        op->k = extended(word & 0x1FFu, 0x100u);
        break;
    case LITERAL_8:
    case LITERAL_7:
    case LITERAL_6:
    case LITERAL_11:
        op->k = (uint16_t)(word & (e->shape == LITERAL_8   ? 0xFFu
                                   : e->shape == LITERAL_7 ? 0x7Fu
                                   : e->shape == LITERAL_6 ? 0x3Fu
                                                           : 0x7FFu));
        break;
    case TRIS_3:
        op->k = word & 7u;
        break;
    case NONE:
    default:
        break;
    }
}

static void decode(pic_op *op, uint16_t word)
{
    const encoding *e = ENCODINGS;
    while ((word & e->mask) != e->word) {
        ++e;
    }
    op->run = e->run;
    op->k = 0;
    op->bit = 0;
    op->n = 0;
    operands(op, e, word);
}

static void find_waits(pic *p)
{
    for (unsigned i = 0; i + ROUND_WORDS <= PIC_WORDS; ++i) {
        pic_op *op = &p->code[i];
        const bool loops = op[1].run == op_bra && op[2].run == op_decfsz && op[2].bit == 1u && op[3].run == op_bra &&
                           op[3].k == (uint16_t)(0u - ROUND_WORDS);
        if (loops && op->run == op_btfss) {
            op->run = op_wait_while_set;
        } else if (loops && op->run == op_btfsc) {
            op->run = op_wait_while_clear;
        } else {
            /* any other instruction */
        }
    }
}

void pic_program(pic *p)
{
    for (unsigned i = 0; i < PIC_WORDS; ++i) {
        p->words[i] &= 0x3FFFu;
        decode(&p->code[i], p->words[i]);
    }
    find_waits(p);
}

static void op_stay(pic *p, const pic_op *op)
{
    (void)op;
    go(p, p->pc - 1u);
}

void pic_hang(pic *p)
{
    const uint16_t at = p->pc;
    const pic_op kept = p->code[at];
    const uint32_t resets = p->resets[RESET_BY_WDT];
    p->code[at].run = op_stay;
    while (p->resets[RESET_BY_WDT] == resets && p->events[EVENT_WDT] != PIC_NEVER) {
        pic_step(p);
    }
    p->code[at] = kept;
}

static void instruction(pic *p)
{
    const pic_op *op = &p->code[p->pc];
    p->pc = (uint16_t)((p->pc + 1u) & PC_MASK);
    ++p->cycles;
    op->run(p, op);
}

void pic_step(pic *p)
{
    if (!p->asleep) {
        instruction(p);
    } else {
        p->cycles = p->next_event > p->cycles ? p->next_event : p->cycles;
    }
    if (p->cycles >= p->next_event) {
        pic_service(p);
    }
}

void pic_run(pic *p, uint64_t until)
{
    pic_at(p, EVENT_END, until);
    while (p->cycles < until) {
        if (p->asleep) {
            p->cycles = p->next_event > p->cycles ? p->next_event : p->cycles;
        }
        while (p->cycles < p->next_event) {
            instruction(p);
        }
        pic_service(p);
    }
}
