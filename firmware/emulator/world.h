/* The board around the chip: MPU-6050 and BNO055 on I2C, LISY300 and the cell on the ADC, an nRF24L01+ on SPI and
 * another one in the distance. The chips' registers, the air and the sensors at rest are those of the host board. */
#ifndef GSENSE_EMULATOR_WORLD_H
#define GSENSE_EMULATOR_WORLD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "air.h"
#include "chips.h"
#include "faults.h"
#include "image.h"

#define WORLD_BURST 20u

typedef enum { ROLE_BOARD, ROLE_RECEIVER } world_role;

typedef struct {
    world_role role;
    uint32_t seed;
    fault_options faults;    /* sda_low, stretch, radio_stuck, radio_reset, lose, air_loss */
    fault_window deaf;       /* the distant receiver hears nothing: MAX_RT */
    fault_window mpu_absent; /* does not answer */
    double bno_stretch_us;   /* at every transfer, as the chip does when it is busy */
    double frames_per_s;     /* receiver: what the distant board sends */
    double frames_until_s;   /* and until when */
} world_options;

/* A frame that the distant receiver got (or, for the receiver's hex, that was sent to it). */
typedef struct {
    uint64_t ns;
    uint8_t bytes[NRF_PAYLOAD];
} heard_frame;

/* A burst that a chip on I2C gave: what was on the bus. */
typedef struct {
    uint64_t start_ns; /* of its first START */
    uint8_t address;
    uint8_t reg;
    uint8_t size;
    uint8_t bytes[WORLD_BURST];
} burst;

typedef struct {
    uint64_t ns;
    uint8_t byte;
} serial_byte;

typedef struct {
    void *items;
    size_t count;
    size_t room;
} growing;

typedef enum { SLAVE_IDLE, SLAVE_ADDRESS, SLAVE_REGISTER, SLAVE_WRITE, SLAVE_READ, SLAVE_IGNORED } slave_state;

struct outside {
    world_options options;
    chips registers;
    sensor_image image; /* of the transfer under way */
    sensor_image analog;
    uint64_t analog_slot; /* 5 ms since which `analog` holds, + 1 */
    unsigned lisy_index;
    air air;
    /* I2C */
    slave_state slave;
    uint8_t address;
    uint8_t reg;
    burst now;
    uint64_t scl_until;
    unsigned sda_clocks_left;
    bool sda_struck;
    bool scl_low;
    /* SPI */
    bool selected;
    bool ce;
    uint8_t command;
    uint8_t status;
    uint8_t data[NRF_PAYLOAD];
    uint8_t answer[NRF_PAYLOAD];
    uint8_t count; /* bytes after the command, 0xFF: command not yet here */
    bool radio_was_reset;
    /* receiver's hex: the frames of the distant board */
    uint64_t next_frame_ns;
    uint16_t sequence;
    uint64_t frames_refused; /* no room in the distant radio */
    /* logs */
    growing frames;
    growing bursts;
    growing serial;
};

void world_init(struct outside *o, const world_options *options);
void world_free(struct outside *o);
/* The radio that hangs on the chip's SPI. */
nrf_chip *world_radio(struct outside *o);
void world_advance(struct outside *o, uint64_t ns);
uint64_t world_next(struct outside *o, uint64_t ns);
void world_add(growing *list, const void *item, size_t size);

#endif
