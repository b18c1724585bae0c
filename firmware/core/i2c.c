#include "i2c.h"

#include "config.h"
#include "counters.h"
#include "hal.h"

static bool settle(i2c_bus *bus, hal_status status)
{
    if (status == HAL_OK) {
        return true;
    }
    count_u8(&bus->errors);
    if (status != HAL_NACK) { /* after a plain refusal the bus itself is fine */
        hal_i2c_recover();
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
