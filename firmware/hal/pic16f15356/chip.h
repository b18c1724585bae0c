/* The registers of the PIC16F15356 that this HAL uses (data sheet DS40001866, register summary), and what the two compilers
 * call them. SDCC is what builds and is tested; the lines for XC8 have never been compiled. */
#ifndef GSENSE_CHIP_H
#define GSENSE_CHIP_H

#include <stdint.h>

#ifdef __XC8 /* never built */
#include <xc.h>
#define CHIP_REGISTER(name, address)
#define CHIP_INTERRUPT __interrupt()
#define CHIP_NOP() NOP()
#define CHIP_CLEAR_WATCHDOG() CLRWDT()
#define CHIP_RAM
#else
#ifdef CHIP_DEFINE_REGISTERS /* in registers.c alone */
#define CHIP_REGISTER(name, address) __at(address) volatile __sfr name
#else
#define CHIP_REGISTER(name, address) extern __at(address) volatile __sfr name
#endif
#define CHIP_INTERRUPT __interrupt(0)
#define CHIP_RAM __data /* a pointer of two bytes in place of SDCC's generic three */
/* clang-format off */
#define CHIP_NOP() __asm nop __endasm
#define CHIP_CLEAR_WATCHDOG() __asm clrwdt __endasm
/* clang-format on */
#endif

CHIP_REGISTER(INDF0, 0x0000);
CHIP_REGISTER(INDF1, 0x0001);
CHIP_REGISTER(PCL, 0x0002);
CHIP_REGISTER(STATUS, 0x0003);
CHIP_REGISTER(FSR0L, 0x0004);
CHIP_REGISTER(FSR0H, 0x0005);
CHIP_REGISTER(FSR1L, 0x0006);
CHIP_REGISTER(FSR1H, 0x0007);
CHIP_REGISTER(BSR, 0x0008);
CHIP_REGISTER(WREG, 0x0009);
CHIP_REGISTER(PCLATH, 0x000A);
CHIP_REGISTER(INTCON, 0x000B);
CHIP_REGISTER(PORTB, 0x000D);
CHIP_REGISTER(PORTC, 0x000E);
CHIP_REGISTER(TRISA, 0x0012);
CHIP_REGISTER(TRISB, 0x0013);
CHIP_REGISTER(TRISC, 0x0014);
CHIP_REGISTER(LATB, 0x0019);
CHIP_REGISTER(LATC, 0x001A);
CHIP_REGISTER(ADRESL, 0x009B);
CHIP_REGISTER(ADRESH, 0x009C);
CHIP_REGISTER(ADCON0, 0x009D);
CHIP_REGISTER(ADCON1, 0x009E);
CHIP_REGISTER(TX1REG, 0x011A);
CHIP_REGISTER(SP1BRGL, 0x011B);
CHIP_REGISTER(SP1BRGH, 0x011C);
CHIP_REGISTER(RC1STA, 0x011D);
CHIP_REGISTER(TX1STA, 0x011E);
CHIP_REGISTER(BAUD1CON, 0x011F);
CHIP_REGISTER(SSP1BUF, 0x018C);
CHIP_REGISTER(SSP1ADD, 0x018D);
CHIP_REGISTER(SSP1STAT, 0x018F);
CHIP_REGISTER(SSP1CON1, 0x0190);
CHIP_REGISTER(SSP1CON2, 0x0191);
CHIP_REGISTER(SSP2BUF, 0x0196);
CHIP_REGISTER(SSP2STAT, 0x0199);
CHIP_REGISTER(SSP2CON1, 0x019A);
CHIP_REGISTER(TMR1L, 0x020C);
CHIP_REGISTER(TMR1H, 0x020D);
CHIP_REGISTER(T1CON, 0x020E);
CHIP_REGISTER(T1CLK, 0x0211);
CHIP_REGISTER(PIR1, 0x070D);
CHIP_REGISTER(PIR3, 0x070F);
CHIP_REGISTER(PIR4, 0x0710);
CHIP_REGISTER(PIE1, 0x0717);
CHIP_REGISTER(PIE3, 0x0719);
CHIP_REGISTER(PIE4, 0x071A);
CHIP_REGISTER(PCON0, 0x0813);

/* Far above what the linker's bank selection reaches: by address. */
#define CHIP_AT(address) (*(volatile CHIP_RAM uint8_t *)(address))
#define SSP1CLKPPS_AT 0x1EC5u
#define SSP1DATPPS_AT 0x1EC6u
#define SSP2CLKPPS_AT 0x1EC8u
#define SSP2DATPPS_AT 0x1EC9u
#define RX1DTPPS_AT 0x1ECBu
#define RB1PPS_AT 0x1F19u
#define RB3PPS_AT 0x1F1Bu
#define RC3PPS_AT 0x1F23u
#define RC4PPS_AT 0x1F24u
#define RC6PPS_AT 0x1F26u
#define ANSELA_AT 0x1F38u
#define ANSELB_AT 0x1F43u
#define ANSELC_AT 0x1F4Eu

/* Codes of the peripheral pin select. */
#define PPS_LATCH 0x00u
#define PPS_TX1 0x0Fu
#define PPS_SCL1 0x15u
#define PPS_SDA1 0x16u
#define PPS_SCK2 0x17u
#define PPS_SDO2 0x18u
#define PPS_FROM_RB1 0x09u
#define PPS_FROM_RB2 0x0Au
#define PPS_FROM_RC3 0x13u
#define PPS_FROM_RC4 0x14u
#define PPS_FROM_RC7 0x17u

/* Pins (BOARD.md). */
#define PIN_RADIO_IRQ 0x01u /* RB0 */
#define PIN_SCK 0x02u       /* RB1 */
#define PIN_MOSI 0x08u      /* RB3 */
#define PIN_CSN 0x10u       /* RB4 */
#define PIN_CE 0x20u        /* RB5 */
#define PIN_SCL 0x08u       /* RC3 */
#define PIN_SDA 0x10u       /* RC4 */
#define PIN_TX 0x40u        /* RC6 */

/* Bits. */
#define INTCON_GIE 0x80u
#define INTCON_PEIE 0x40u
#define PIR1_ADIF 0x01u
#define PIR3_SSP1IF 0x01u
#define PIR3_BCL1IF 0x02u
#define PIR3_SSP2IF 0x04u
#define PIR3_TX1IF 0x10u
#define PIR4_TMR1IF 0x01u
#define SSPCON1_SSPEN 0x20u
#define SSPCON2_SEN 0x01u
#define SSPCON2_RSEN 0x02u
#define SSPCON2_PEN 0x04u
#define SSPCON2_RCEN 0x08u
#define SSPCON2_ACKEN 0x10u
#define SSPCON2_ACKDT 0x20u
#define SSPCON2_ACKSTAT 0x40u
#define SSPSTAT_BF 0x01u
#define SSPSTAT_CKE 0x40u
#define ADCON0_ADON 0x01u
#define ADCON0_GO 0x02u

/* FSR1, which SDCC leaves alone, walks over a buffer: a tenth of what its pointers of three bytes cost. */
#define CHIP_STEP_FSR1()                                                                                               \
    do {                                                                                                               \
        ++FSR1L;                                                                                                       \
        if (FSR1L == 0u) {                                                                                             \
            ++FSR1H;                                                                                                   \
        }                                                                                                              \
    } while (0)

void chip_init(void);

/* FSR1 to the first byte of `data`, in RAM or flash. */
void chip_point_fsr1(const uint8_t *data);

#endif
