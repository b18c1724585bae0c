/* A PIC16F15356 that runs the words of its flash: core, RAM, and the peripherals that the firmware uses.
 *
 * Time is counted in instruction cycles (125 ns at 32 MHz). Between two events of the peripherals only instructions
 * run; timers are worked out when they are looked at. Registers of the chip that are not modelled keep what is written,
 * and every access to them is counted (`strays`), as is one to an address where the chip has nothing.
 */
#ifndef GSENSE_EMULATOR_PIC_H
#define GSENSE_EMULATOR_PIC_H

#include <stdbool.h>
#include <stdint.h>

#define PIC_WORDS 16384u
#define PIC_DATA 8192u /* 64 banks of 128 */
#define PIC_CONFIGS 5u
#define PIC_STACK 16u
#define PIC_PORTS 3u
#define PIC_NEVER UINT64_MAX

typedef struct pic pic;
typedef struct pic_op pic_op;
struct outside;

struct pic_op {
    void (*run)(pic *p, const pic_op *op);
    uint16_t k;  /* literal, target or file address in its bank */
    uint8_t bit; /* mask of a bit, or 0 / 1 for the destination, or the mode of MOVIW and MOVWI */
    uint8_t n;   /* FSR */
};

typedef enum {
    EVENT_TMR0,
    EVENT_TMR1,
    EVENT_TMR2,
    EVENT_SSP1,
    EVENT_SSP2,
    EVENT_ADC,
    EVENT_TX1,
    EVENT_RX1,
    EVENT_WDT,
    EVENT_OUTSIDE,
    EVENT_END,
    EVENTS
} pic_event;

typedef enum {
    RESET_BY_POWER,
    RESET_BY_BROWN_OUT,
    RESET_BY_WDT,
    RESET_BY_WDT_WINDOW,
    RESET_BY_INSTRUCTION,
    RESET_BY_OVERFLOW,
    RESET_BY_UNDERFLOW,
    RESETS
} pic_reset_cause;

/* A counter with a prescaler: its value at `since` was `value`. */
typedef struct {
    bool on;
    uint32_t per_tick; /* cycles a tick; 0: clock source not modelled */
    uint64_t since;
    uint32_t value;
    uint8_t post; /* overflows until the flag is set */
} pic_timer;

typedef enum { SSP_IDLE, SSP_START, SSP_RESTART, SSP_STOP, SSP_SEND, SSP_RECEIVE, SSP_ACK, SSP_SPI } ssp_activity;

typedef struct {
    ssp_activity doing;
    bool has_bus; /* START was seen, STOP not yet */
    uint8_t shift;
} pic_ssp;

/* Who watches calls and returns (profile and slots); `target` 4 with `interrupt` for an interrupt. */
typedef struct {
    void (*call)(void *context, uint16_t target);
    void (*leave)(void *context);
    void *context;
} pic_watch;

struct pic {
    uint64_t cycles;
    uint64_t next_event;
    uint16_t pc;
    uint16_t fsr[2];
    uint8_t w;
    uint8_t status;
    uint8_t bsr;
    uint8_t pclath;
    uint8_t intcon;
    uint8_t stkptr; /* 0x1F: empty */
    bool asleep;
    uint8_t mem[PIC_DATA];
    uint8_t kind[PIC_DATA]; /* 0: plain, see memory_map.h */
    bool look[PIC_DATA];    /* reading it needs pic_read */
    pic_op code[PIC_WORDS];
    uint16_t stack[PIC_STACK];

    uint16_t words[PIC_WORDS];
    uint16_t config[PIC_CONFIGS];
    uint64_t events[EVENTS]; /* when, in cycles */
    uint64_t base_ns;        /* true time at `base_cycles` */
    uint64_t base_cycles;
    uint32_t cycle_ns;
    double ppm; /* the oscillator runs fast by so much */

    pic_timer timer[3];
    pic_ssp ssp[2];
    uint8_t lat_seen[PIC_PORTS];
    uint64_t channel_since; /* ADC: when its channel was chosen */
    bool tx_waiting;        /* TX1REG is full */
    bool tx_shifting;
    uint64_t wdt_cleared;
    uint8_t pps_key;

    struct outside *outside;
    pic_watch watch;

    /* what is to be reported */
    uint32_t strays[PIC_DATA];
    uint64_t stray_total;
    uint32_t resets[RESETS];
    pic_reset_cause last_reset;
    uint8_t deepest; /* stack levels */
    uint32_t bad_opcodes;
    uint32_t bus_misuse; /* MSSP told to do something while busy, or a byte that no pin carries */
    uint32_t adc_rushed; /* conversions with TAD < 1 us, or started less than 2 us after a change of channel */
    uint64_t sleeps;
};

/* Memory is cleared; flash holds nothing. */
void pic_init(pic *p, struct outside *outside);
/* Decodes the flash. To be called after the words were loaded, before pic_reset. */
void pic_program(pic *p);
void pic_reset(pic *p, pic_reset_cause cause);
/* Runs until the cycle counter reaches `until` (an instruction of two cycles may end one later). */
void pic_run(pic *p, uint64_t until);
/* One instruction, with the events that it makes due. */
void pic_step(pic *p);

/* The program stays where it is (interrupts still run) until the watchdog resets it; returns at once where that is off.
 */
void pic_hang(pic *p);

/* True time in ns since power-on. */
uint64_t pic_ns(const pic *p);
uint64_t pic_cycles_at(const pic *p, uint64_t ns);
void pic_set_cycle_ns(pic *p, uint32_t cycle_ns);

/* data memory, with all effects */
uint8_t pic_read(pic *p, uint16_t address);
void pic_write(pic *p, uint16_t address, uint8_t value);
uint8_t pic_read_far(pic *p, uint16_t fsr);
void pic_write_far(pic *p, uint16_t fsr, uint8_t value);
void pic_stray(pic *p, uint16_t address);

#endif
