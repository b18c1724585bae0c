/* I2C at 400 kHz: MSSP1 as master, polled, every wait bounded by the transfer's deadline. */
#include "bursts.h"
#include "chip.h"
#include "hal.h"

#define MASTER 0x28u          /* SSPEN, I2C master */
#define DIVIDER_400_KHZ 19u   /* 32 MHz / (4 * 400 kHz) - 1 */
#define POLLS 200u            /* between looks at the clock: 0.2 ms at most */
#define PINS (PIN_SCL | PIN_SDA)

static uint16_t started_us;
static uint16_t allowed_us;
static hal_status failure;

static uint16_t micros16(void)
{
    const uint8_t low = TMR1L; /* latches the upper byte */
    return (uint16_t)(((uint16_t)TMR1H << 8) | low);
}

/* Waits for the end of what was started; false, and `failure` set, when the bus was lost or the time is up. */
static bool done(void)
{
    for (;;) {
        uint8_t polls = POLLS;
        do {
            if ((PIR3 & PIR3_SSP1IF) != 0u) {
                PIR3 &= (uint8_t)~PIR3_SSP1IF;
                return true;
            }
            --polls;
        } while (polls != 0u);
        if ((PIR3 & PIR3_BCL1IF) != 0u) {
            failure = HAL_STUCK;
            return false;
        }
        if ((uint16_t)(micros16() - started_us) > allowed_us) {
            failure = HAL_TIMEOUT;
            return false;
        }
    }
}

static bool sent(uint8_t byte)
{
    SSP1BUF = byte;
    if (!done()) {
        return false;
    }
    if ((SSP1CON2 & SSPCON2_ACKSTAT) != 0u) {
        failure = HAL_NACK;
        return false;
    }
    return true;
}

static hal_status finish(bool good)
{
    if (good || failure == HAL_NACK) {
        const hal_status status = good ? HAL_OK : HAL_NACK;
        PIR3 &= (uint8_t)~PIR3_SSP1IF;
        SSP1CON2 |= SSPCON2_PEN;
        return done() ? status : failure;
    }
    return failure;
}

static bool lines_free(uint16_t deadline_us)
{
    started_us = micros16();
    allowed_us = deadline_us;
    failure = HAL_STUCK;
    PIR3 &= (uint8_t) ~(PIR3_SSP1IF | PIR3_BCL1IF);
    return (PORTC & PINS) == PINS;
}

/* What is left of the deadline, in polls of 0.75 us (more where interrupts come between): 0 when it is over. */
static uint16_t polls_left(void)
{
    const uint16_t elapsed_us = (uint16_t)(micros16() - started_us);
    if (elapsed_us >= allowed_us) {
        return 0u;
    }
    return (uint16_t)(allowed_us - elapsed_us);
}

static bool timed_out(void)
{
    if ((PIR3 & PIR3_BCL1IF) == 0u) {
        failure = HAL_TIMEOUT;
    }
    return false;
}

static bool selected(uint8_t address, uint8_t reg)
{
    const uint8_t answer = i2c_select((uint8_t)(address << 1), reg, allowed_us);
    if (answer == I2C_REFUSED) {
        failure = HAL_NACK;
        return false;
    }
    if (answer != I2C_SELECTED || (PIR3 & PIR3_BCL1IF) != 0u) {
        return timed_out();
    }
    return true;
}

static bool received(uint8_t *data, uint8_t length)
{
    const uint16_t polls = polls_left();
    if (polls == 0u) {
        return timed_out();
    }
    chip_point_fsr1(data);
    if (i2c_burst(length, polls) == 0u) {
        return timed_out();
    }
    return true;
}

hal_status hal_i2c_read(uint8_t address, uint8_t reg, uint8_t *data, uint8_t length, uint16_t deadline_us)
{
    return finish(lines_free(deadline_us) && selected(address, reg) && received(data, length));
}

hal_status hal_i2c_write(uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length, uint16_t deadline_us)
{
    if (!lines_free(deadline_us)) {
        return finish(false);
    }
    SSP1CON2 |= SSPCON2_SEN;
    if (!done() || !sent((uint8_t)(address << 1)) || !sent(reg)) {
        return finish(false);
    }
    chip_point_fsr1(data);
    for (; length != 0u; --length) {
        const uint8_t byte = INDF1;
        CHIP_STEP_FSR1();
        if (!sent(byte)) {
            return finish(false);
        }
    }
    return finish(true);
}

bool hal_i2c_drive(bool scl, bool sda)
{
    SSP1CON1 = 0u;
    CHIP_AT(RC3PPS_AT) = PPS_LATCH;
    CHIP_AT(RC4PPS_AT) = PPS_LATCH;
    uint8_t released = 0u; /* the latches are low: an output pulls down, an input lets go */
    if (scl) {
        released |= PIN_SCL;
    }
    if (sda) {
        released |= PIN_SDA;
    }
    TRISC = (uint8_t)((TRISC & (uint8_t)~PINS) | released);
    for (uint8_t wait = 10u; wait != 0u; --wait) { /* 4 cycles at least each: 5 us */
        CHIP_NOP();
    }
    return (PORTC & PIN_SDA) != 0u;
}

void hal_i2c_restart(void)
{
    SSP1CON1 = 0u;
    TRISC |= PINS;
    CHIP_AT(SSP1CLKPPS_AT) = PPS_FROM_RC3;
    CHIP_AT(SSP1DATPPS_AT) = PPS_FROM_RC4;
    CHIP_AT(RC3PPS_AT) = PPS_SCL1;
    CHIP_AT(RC4PPS_AT) = PPS_SDA1;
    SSP1STAT = 0u;
    SSP1CON2 = 0u;
    SSP1ADD = DIVIDER_400_KHZ;
    SSP1CON1 = MASTER;
}
