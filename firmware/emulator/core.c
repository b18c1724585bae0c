/* The enhanced mid-range core: 49 instructions, each a function; flash is decoded once. */
#include "instructions.h"

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
