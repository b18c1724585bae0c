#include "i2c.h"

#include "config.h"
#include "counters.h"
#include "hal.h"

#define BYTE_CLOCKS 9u

bool i2c_recover(i2c_bus *bus)
{
    bool sda = hal_i2c_drive(true, true);
    for (uint8_t clock = 0; clock < BYTE_CLOCKS && !sda; ++clock) {
        (void)hal_i2c_drive(false, true);
        sda = hal_i2c_drive(true, true);
    }
    (void)hal_i2c_drive(true, false); /* START, STOP: every chip waits for its address again */
    sda = hal_i2c_drive(true, true);
    hal_i2c_restart();
    count_u8(&bus->recoveries);
    if (!sda) {
        count_u8(&bus->stuck);
    }
    return sda;
}

static bool settle(i2c_bus *bus, hal_status status)
{
    if (status == HAL_OK) {
        return true;
    }
    count_u8(&bus->errors);
    if (status == HAL_TIMEOUT) {
        count_u8(&bus->timeouts);
    }
    if (status != HAL_NACK) { /* after a plain refusal the bus itself is fine */
        (void)i2c_recover(bus);
    }
    return false;
}

bool i2c_read(i2c_bus *bus, uint8_t address, uint8_t reg, uint8_t *data, uint8_t length)
{
    return settle(bus, hal_i2c_read(address, reg, data, length, I2C_DEADLINE_US));
}

bool i2c_write(i2c_bus *bus, uint8_t address, uint8_t reg, const uint8_t *data, uint8_t length)
{
    return settle(bus, hal_i2c_write(address, reg, data, length, I2C_DEADLINE_US));
}

bool i2c_write_byte(i2c_bus *bus, uint8_t address, uint8_t reg, uint8_t value)
{
    return i2c_write(bus, address, reg, &value, 1);
}
