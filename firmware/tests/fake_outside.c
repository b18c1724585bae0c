#include "fake_outside.h"

void outside_i2c_start(struct outside *o, uint64_t ns)
{
    (void)ns;
    ++o->starts;
}

bool outside_i2c_send(struct outside *o, uint8_t byte, uint64_t ns)
{
    (void)ns;
    o->i2c_sent[o->i2c_count++ % 8u] = byte;
    return o->acknowledges;
}

uint8_t outside_i2c_receive(struct outside *o, uint64_t ns)
{
    (void)ns;
    return o->i2c_bytes[o->i2c_given++ % 8u];
}

void outside_i2c_acknowledge(struct outside *o, bool ack)
{
    o->acks += ack ? 1u : 0u;
    o->nacks += ack ? 0u : 1u;
}

void outside_i2c_stop(struct outside *o, uint64_t ns)
{
    (void)ns;
    ++o->stops;
}

uint64_t outside_scl_held(struct outside *o, uint64_t ns) { return o->scl_until > ns ? o->scl_until : 0; }

bool outside_sda_held(struct outside *o, uint64_t ns)
{
    (void)ns;
    return o->sda_low;
}

uint8_t outside_spi(struct outside *o, uint8_t byte, uint64_t ns)
{
    (void)ns;
    o->spi_sent[o->spi_count++ % 8u] = byte;
    return o->spi_answer;
}

bool outside_pin(struct outside *o, unsigned pin, int driven, uint64_t ns)
{
    (void)ns;
    return driven >= 0 ? driven == 1 : (o->pins_high >> pin & 1u) != 0;
}

void outside_pins_changed(struct outside *o, int (*driven)(const void *context, unsigned pin), const void *context,
                          uint64_t ns)
{
    (void)ns;
    o->driven_high = 0;
    o->driven_low = 0;
    for (unsigned pin = 0; pin < 24u; ++pin) {
        const int level = driven(context, pin);
        o->driven_high |= level == 1 ? 1u << pin : 0u;
        o->driven_low |= level == 0 ? 1u << pin : 0u;
    }
}

uint16_t outside_adc(struct outside *o, unsigned channel, uint64_t ns)
{
    (void)ns;
    o->adc_channel = channel;
    return o->adc_code;
}

void outside_uart(struct outside *o, uint8_t byte, uint64_t ns)
{
    o->uart_ns[o->uart_count % 16u] = ns;
    o->uart[o->uart_count++ % 16u] = byte;
}

void outside_reset(struct outside *o, bool power, uint64_t ns)
{
    (void)power;
    (void)ns;
    ++o->resets;
}

uint64_t outside_tick(struct outside *o, uint64_t ns)
{
    (void)o;
    return ns + 1000000000u;
}
