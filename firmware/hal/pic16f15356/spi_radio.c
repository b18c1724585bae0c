/* The radio: MSSP2 as SPI master at 2 MHz (mode 0), CSN, CE and IRQ as plain pins. A byte takes 4 us, which the master's own
 * clock ends; the count of the polls bounds the wait all the same. */
#include "bursts.h"
#include "chip.h"
#include "hal.h"
#include "peripherals.h"

#define MASTER_FOSC_16 0x21u /* SSPEN, 32 MHz / 16 */
#define POLLS 100u

void spi_init(void)
{
    CHIP_AT(SSP2CLKPPS_AT) = PPS_FROM_RB1;
    CHIP_AT(SSP2DATPPS_AT) = PPS_FROM_RB2;
    CHIP_AT(RB1PPS_AT) = PPS_SCK2;
    CHIP_AT(RB3PPS_AT) = PPS_SDO2;
    SSP2STAT = SSPSTAT_CKE;
    SSP2CON1 = MASTER_FOSC_16;
}

#define EXCHANGE(byte)                                                                                                 \
    do {                                                                                                               \
        SSP2BUF = (byte);                                                                                              \
        uint8_t polls = POLLS;                                                                                         \
        while ((SSP2STAT & SSPSTAT_BF) == 0u && polls != 0u) {                                                         \
            --polls;                                                                                                   \
        }                                                                                                              \
    } while (0)

uint8_t hal_radio_write(uint8_t command, const uint8_t *data, uint8_t length)
{
    LATB &= (uint8_t)~PIN_CSN;
    EXCHANGE(command);
    const uint8_t status = SSP2BUF;
    if (length != 0u) {
        chip_point_fsr1(data);
        spi_send(length);
    }
    LATB |= PIN_CSN;
    return status;
}

uint8_t hal_radio_read(uint8_t command, uint8_t *data, uint8_t length)
{
    LATB &= (uint8_t)~PIN_CSN;
    EXCHANGE(command);
    const uint8_t status = SSP2BUF;
    chip_point_fsr1(data);
    spi_take(length);
    LATB |= PIN_CSN;
    return status;
}

void hal_radio_ce(bool high)
{
    if (high) {
        LATB |= PIN_CE;
    } else {
        LATB &= (uint8_t)~PIN_CE;
    }
}

bool hal_radio_irq(void) { return (PORTB & PIN_RADIO_IRQ) == 0u; }
