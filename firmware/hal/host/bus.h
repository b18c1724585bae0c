/* The sensor bus: a memory-mapped file that the simulation of the rig writes (layout: docs/architecture.md, "Sensor bus").
 * This side reads images and writes configuration registers. */
#ifndef GSENSE_BUS_H
#define GSENSE_BUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "chips.h"
#include "image.h"

#define BUS_SILENT_NS 500000000u /* a bus without heartbeat for this long is dead */

typedef struct {
    const char *path;
    uint8_t *map; /* NULL: no bus seen yet */
    size_t size;
    uint64_t capacity;
    size_t image_size;
    dev_t device;
    ino_t inode;
    uint64_t usable_from_ns; /* images before it may not know the board's configuration yet */
} sensor_bus;

typedef enum {
    BUS_FOUND,
    BUS_NOT_YET, /* the simulation has not passed that instant */
    BUS_GONE     /* the ring does not hold it any more, or it is from before the configuration was written */
} bus_answer;

void bus_init(sensor_bus *bus, const char *path);

/* Looks whether a live bus (or a new one in place of the old) is there, and attaches it, writing the chips' configuration.
 * Returns true when it did. A file that is no bus is said on stderr once. */
bool bus_poll(sensor_bus *bus, const chips *registers, uint64_t now_ns);

bool bus_is_silent(const sensor_bus *bus, uint64_t now_ns);

/* The newest image of `time_ns` or before, once the simulation has gone past it. */
bus_answer bus_image_at(const sensor_bus *bus, uint64_t time_ns, sensor_image *image);

/* Writes the chips' configuration registers into the file and counts it. */
void bus_write_registers(sensor_bus *bus, const chips *registers);

void bus_close(sensor_bus *bus);

#endif
