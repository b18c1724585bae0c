/* PIC16F15356: addresses and bits of the registers that the emulator models (data sheet DS40001866). */
#ifndef GSENSE_EMULATOR_REGISTERS_H
#define GSENSE_EMULATOR_REGISTERS_H

/* core registers, the same in every bank */
enum {
    R_INDF0,
    R_INDF1,
    R_PCL,
    R_STATUS,
    R_FSR0L,
    R_FSR0H,
    R_FSR1L,
    R_FSR1H,
    R_BSR,
    R_WREG,
    R_PCLATH,
    R_INTCON,
    R_CORE_END
};

enum {
    R_PORTA = 0x00C,
    R_PORTE = 0x010,
    R_TRISA = 0x012,
    R_LATA = 0x018,
    R_ADRESL = 0x09B,
    R_ADRESH,
    R_ADCON0,
    R_ADCON1,
    R_ADACT,
    R_RC1REG = 0x119,
    R_TX1REG,
    R_SP1BRGL,
    R_SP1BRGH,
    R_RC1STA,
    R_TX1STA,
    R_BAUD1CON,
    R_SSP1BUF = 0x18C,
    R_SSP1ADD,
    R_SSP1MSK,
    R_SSP1STAT,
    R_SSP1CON1,
    R_SSP1CON2,
    R_SSP1CON3,
    R_SSP2BUF = 0x196,
    R_SSP2ADD,
    R_SSP2MSK,
    R_SSP2STAT,
    R_SSP2CON1,
    R_SSP2CON2,
    R_SSP2CON3,
    R_TMR1L = 0x20C,
    R_TMR1H,
    R_T1CON,
    R_T1GCON,
    R_T1GATE,
    R_T1CLK,
    R_T2TMR = 0x28C,
    R_T2PR,
    R_T2CON,
    R_T2HLT,
    R_T2CLKCON,
    R_T2RST,
    R_TMR0L = 0x59C,
    R_TMR0H,
    R_T0CON0,
    R_T0CON1,
    R_PIR0 = 0x70C,
    R_PIE0 = 0x716,
    R_PMD0 = 0x796,
    R_WDTCON0 = 0x80C,
    R_WDTCON1,
    R_WDTPSL,
    R_WDTPSH,
    R_WDTTMR,
    R_BORCON,
    R_VREGCON,
    R_PCON0,
    R_PCON1,
    R_NVMADRL = 0x81A,
    R_NVMCON2 = 0x81F,
    R_CPUDOZE = 0x88C,
    R_OSCCON1,
    R_OSCCON2,
    R_OSCCON3,
    R_OSCSTAT,
    R_OSCEN,
    R_OSCTUNE,
    R_OSCFRQ,
    R_FVRCON = 0x90C,
    R_PPSLOCK = 0x1E8F,
    R_SSP1CLKPPS = 0x1EC5,
    R_SSP1DATPPS,
    R_SSP1SSPPS,
    R_SSP2CLKPPS,
    R_SSP2DATPPS,
    R_SSP2SSPPS,
    R_RX1DTPPS,
    R_TX1CKPPS,
    R_RA0PPS = 0x1F10,
    R_ANSELA = 0x1F38,
    R_ANSELB = 0x1F43,
    R_ANSELC = 0x1F4E,
    R_STATUS_SHAD = 0x1FE4,
    R_STKPTR = 0x1FED,
    R_TOSL,
    R_TOSH
};

#define STATUS_C 0x01u
#define STATUS_DC 0x02u
#define STATUS_Z 0x04u
#define STATUS_PD 0x08u
#define STATUS_TO 0x10u

#define INTCON_PEIE 0x40u
#define INTCON_GIE 0x80u

#define PCON0_BOR 0x01u
#define PCON0_POR 0x02u
#define PCON0_RI 0x04u
#define PCON0_RWDT 0x10u
#define PCON0_WDTWV 0x20u
#define PCON0_STKUNF 0x40u
#define PCON0_STKOVF 0x80u

#define PIR0_TMR0 0x20u /* in PIR0 */
#define PIR1_AD 0x01u
#define PIR3_SSP1 0x01u
#define PIR3_BCL1 0x02u
#define PIR3_SSP2 0x04u
#define PIR3_TX1 0x10u
#define PIR3_RC1 0x20u
#define PIR4_TMR1 0x01u
#define PIR4_TMR2 0x02u

#define ADCON0_ADON 0x01u
#define ADCON0_GO 0x02u

#define SSP_BF 0x01u /* SSPxSTAT */
#define SSP_RW 0x04u
#define SSP_S 0x08u
#define SSP_P 0x10u
#define SSP_SSPEN 0x20u /* SSPxCON1 */
#define SSP_OV 0x40u
#define SSP_WCOL 0x80u
#define SSP_SEN 0x01u /* SSPxCON2 */
#define SSP_RSEN 0x02u
#define SSP_PEN 0x04u
#define SSP_RCEN 0x08u
#define SSP_ACKEN 0x10u
#define SSP_ACKDT 0x20u
#define SSP_ACKSTAT 0x40u

/* outputs that RxyPPS can choose */
#define PPS_TX1 0x0Fu
#define PPS_SCL1 0x15u
#define PPS_SDA1 0x16u
#define PPS_SCK2 0x17u
#define PPS_SDO2 0x18u

/* pins by number, as the input PPS registers count them: port * 8 + bit */
#define PIN_RA0 0x00u
#define PIN_RB0 0x08u
#define PIN_RC0 0x10u

#endif
