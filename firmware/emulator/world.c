/* Sensors, pins and logs. */
#include "world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bno055.h"
#include "config.h"
#include "mpu6050.h"
#include "outside.h"
#include "registers.h"

#define ANALOG_SLOT_NS 5000000u
#define PIN_IRQ PIN_RB0
#define PIN_CSN (PIN_RB0 + 4u)
#define PIN_CE (PIN_RB0 + 5u)
#define PIN_SCL (PIN_RC0 + 3u)
#define PIN_SDA (PIN_RC0 + 4u)
#define CLOCKS_TO_FREE 7u
#define NS_PER_US 1000.0

void world_add(growing *list, const void *item, size_t size)
{
    if (list->count == list->room) {
        list->room = list->room == 0 ? 1024u : 2u * list->room;
        void *grown = realloc(list->items, list->room * size);
        if (grown == NULL) {
            fputs("gsense_pic: out of memory\n", stderr);
            exit(2);
        }
        list->items = grown;
    }
    memcpy((char *)list->items + list->count * size, item, size);
    ++list->count;
}

void world_free(struct outside *o)
{
    free(o->frames.items);
    free(o->bursts.items);
    free(o->serial.items);
}

void outside_reset(struct outside *o, bool power, uint64_t ns)
{
    if (power) {
        chips_power_on(&o->registers, ns);
        nrf_chip_reset(world_radio(o));
    }
    o->slave = SLAVE_IDLE;
    o->scl_until = 0;
    o->selected = false;
}

/* I2C */

static void log_burst(struct outside *o)
{
    if (o->slave == SLAVE_READ && o->now.size > 0) {
        world_add(&o->bursts, &o->now, sizeof o->now);
    }
}

void outside_i2c_start(struct outside *o, uint64_t ns)
{
    if (o->slave == SLAVE_IDLE) {
        o->now.start_ns = ns;
    }
    o->slave = SLAVE_ADDRESS;
}

void outside_i2c_stop(struct outside *o, uint64_t ns)
{
    (void)ns;
    log_burst(o);
    o->slave = SLAVE_IDLE;
}

static bool is_there(const struct outside *o, uint8_t address, uint64_t ns)
{
    return chips_answer(&o->registers, address, ns) &&
           !(address == MPU_ADDRESS && fault_window_holds(&o->options.mpu_absent, ns));
}

static void begin_transfer(struct outside *o, bool reads, uint64_t ns)
{
    o->slave = reads ? SLAVE_READ : SLAVE_REGISTER;
    if (reads) {
        bench_image(&o->registers, o->options.seed, ns, &o->image);
        o->now.address = o->address;
        o->now.reg = o->reg;
        o->now.size = 0;
    }
    if (o->address != BNO_ADDRESS) {
        return;
    }
    const fault_window *stretch = &o->options.faults.stretch;
    o->scl_until = fault_window_holds(stretch, ns) ? (uint64_t)((stretch->at_s + stretch->duration_s) * 1e9)
                   : o->options.bno_stretch_us > 0 ? ns + (uint64_t)(o->options.bno_stretch_us * NS_PER_US)
                                                   : 0;
}

bool outside_i2c_send(struct outside *o, uint8_t byte, uint64_t ns)
{
    switch (o->slave) {
    case SLAVE_ADDRESS:
        o->address = byte >> 1;
        if (!is_there(o, o->address, ns)) {
            o->slave = SLAVE_IGNORED;
            return false;
        }
        begin_transfer(o, (byte & 1u) != 0, ns);
        return true;
    case SLAVE_REGISTER:
        o->reg = byte;
        o->slave = SLAVE_WRITE;
        return true;
    case SLAVE_WRITE:
        (void)chips_write(&o->registers, o->address, o->reg, &byte, 1, ns);
        ++o->reg;
        return true;
    default:
        return false;
    }
}

uint8_t outside_i2c_receive(struct outside *o, uint64_t ns)
{
    (void)ns;
    uint8_t byte = 0xFF;
    if (o->slave == SLAVE_READ) {
        (void)chips_read(&o->registers, o->address, o->reg, &byte, 1, &o->image);
        ++o->reg;
        if (o->now.size < WORLD_BURST) {
            o->now.bytes[o->now.size++] = byte;
        }
    }
    return byte;
}

void outside_i2c_acknowledge(struct outside *o, bool ack)
{
    if (!ack) {
        log_burst(o);
        o->slave = SLAVE_IGNORED;
    }
}

uint64_t outside_scl_held(struct outside *o, uint64_t ns) { return o->scl_until > ns ? o->scl_until : 0; }

bool outside_sda_held(struct outside *o, uint64_t ns)
{
    const fault_window *fault = &o->options.faults.sda_low;
    if (fault->wanted && !o->sda_struck && (double)ns >= fault->at_s * 1e9) {
        o->sda_struck = true;
        o->sda_clocks_left = fault->duration_s > 0 ? 0 : CLOCKS_TO_FREE;
    }
    return fault_window_holds(fault, ns) || o->sda_clocks_left > 0;
}

/* pins */

void outside_pins_changed(struct outside *o, int (*driven)(const void *context, unsigned pin), const void *context,
                          uint64_t ns)
{
    world_advance(o, ns);
    const bool scl_low = driven(context, PIN_SCL) == 0;
    if (o->scl_low && !scl_low) {
        o->sda_clocks_left -= o->sda_clocks_left > 0 ? 1u : 0u;
        o->slave = SLAVE_IDLE; /* clocked by hand: no transfer goes on */
    }
    o->scl_low = scl_low;
    world_radio(o)->ce = driven(context, PIN_CE) == 1;
    const bool selected = driven(context, PIN_CSN) == 0;
    if (selected && !o->selected) {
        o->count = 0xFFu;
    } else if (!selected && o->selected && o->count != 0xFFu) {
        const bool writes = (o->command & 0xE0u) == NRF_W_REGISTER || o->command == NRF_W_TX_PAYLOAD;
        (void)nrf_chip_spi(world_radio(o), ns, o->command, writes ? o->data : NULL, writes ? NULL : o->answer,
                           o->count);
    } else {
        /* no edge */
    }
    o->selected = selected;
    world_advance(o, ns);
}

bool outside_pin(struct outside *o, unsigned pin, int driven, uint64_t ns)
{
    switch (pin) {
    case PIN_IRQ:
        world_advance(o, ns);
        return !nrf_chip_irq(world_radio(o));
    case PIN_SDA:
        return driven != 0 && !outside_sda_held(o, ns);
    case PIN_SCL:
        return driven != 0 && outside_scl_held(o, ns) == 0;
    default:
        return driven == 1;
    }
}

/* What the chip will shift out after the command; reading a payload removes it only when CSN rises. */
static void prepare_answer(struct outside *o, uint64_t ns)
{
    nrf_chip *radio = world_radio(o);
    memset(o->answer, 0, sizeof o->answer);
    if (o->command == NRF_R_RX_PAYLOAD) {
        if (radio->rx_count > 0) {
            memcpy(o->answer, radio->rx[0].bytes, NRF_PAYLOAD);
        }
    } else if (o->command == NRF_R_RX_PL_WID || (o->command & 0xE0u) == NRF_R_REGISTER) {
        (void)nrf_chip_spi(radio, ns, o->command, NULL, o->answer, NRF_PAYLOAD);
    } else {
        /* a write or a plain command */
    }
}

uint8_t outside_spi(struct outside *o, uint8_t byte, uint64_t ns)
{
    if (!o->selected) {
        return 0xFF;
    }
    world_advance(o, ns);
    if (o->count == 0xFFu) {
        o->command = byte;
        o->count = 0;
        prepare_answer(o, ns);
        return nrf_chip_spi(world_radio(o), ns, NRF_NOP, NULL, NULL, 0);
    }
    if (o->count >= NRF_PAYLOAD) {
        return 0;
    }
    o->data[o->count] = byte;
    return o->answer[o->count++];
}

uint16_t outside_adc(struct outside *o, unsigned channel, uint64_t ns)
{
    const uint64_t slot = ns / ANALOG_SLOT_NS + 1u;
    if (slot != o->analog_slot) {
        o->analog_slot = slot;
        bench_image(&o->registers, o->options.seed, ns, &o->analog);
    }
    if (channel == 1u) {
        const uint32_t code = (o->analog.battery_mv * 1024u + ADC_REFERENCE_MV) / (ADC_REFERENCE_MV * BATTERY_DIVIDER);
        return code > 1023u ? 1023u : (uint16_t)code;
    }
    if (channel != 0u) {
        return 0;
    }
    o->lisy_index = (o->lisy_index + 1u) % IMAGE_LISY;
    return o->analog.lisy[o->lisy_index] & 1023u;
}

void outside_uart(struct outside *o, uint8_t byte, uint64_t ns)
{
    const serial_byte item = {ns, byte};
    world_add(&o->serial, &item, sizeof item);
}

uint64_t outside_tick(struct outside *o, uint64_t ns)
{
    world_advance(o, ns);
    return world_next(o, ns);
}
