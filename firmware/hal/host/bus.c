#include "bus.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* offsets in the file */
enum { AT_CAPACITY = 8, AT_IMAGE_SIZE = 12, AT_COUNT = 16, AT_HEARTBEAT = 24, AT_CONFIG_COUNT = 32, AT_MPU = 64,
       AT_BNO_PAGE_0 = 192, AT_BNO_PAGE_1 = 320, AT_IMAGES = 512 };
/* offsets in an image */
enum { IMAGE_AT_MPU = 8, IMAGE_AT_BNO = 24, IMAGE_AT_BNO_TIME = 72, IMAGE_AT_LISY = 80, IMAGE_AT_BATTERY = 112,
       IMAGE_MIN_SIZE = 114 };

#define CONFIGURATION_LATENCY_NS 60000000u /* the simulation works with new registers by then */

static const char MAGIC[8] = {'G', 'S', 'N', 'S', 'B', 'U', 'S', '1'};

static uint64_t get(const uint8_t *at, unsigned bytes)
{
    uint64_t value = 0;
    for (unsigned i = bytes; i > 0; --i) {
        value = (value << 8) | at[i - 1];
    }
    return value;
}

/* The counters are naturally aligned u64 in a page-aligned map (little-endian hosts, as the file is). */
static uint64_t load(const uint8_t *at) { return __atomic_load_n((const uint64_t *)(const void *)at, __ATOMIC_ACQUIRE); }

void bus_init(sensor_bus *bus, const char *path)
{
    memset(bus, 0, sizeof *bus);
    bus->path = path;
}

static bool layout_is_right(const uint8_t *map, size_t size)
{
    if (size < AT_IMAGES || memcmp(map, MAGIC, sizeof MAGIC) != 0) {
        return false;
    }
    const uint64_t capacity = get(map + AT_CAPACITY, 4);
    const uint64_t image_size = get(map + AT_IMAGE_SIZE, 4);
    return capacity >= 2 && image_size >= IMAGE_MIN_SIZE && image_size % 8 == 0 &&
           capacity <= (size - AT_IMAGES) / image_size;
}

/* Maps the file at the path. Returns NULL when there is none, or none of ours. */
static uint8_t *map_file(const char *path, struct stat *status)
{
    const int fd = open(path, O_RDWR | O_CLOEXEC);
    if (fd < 0) {
        return NULL;
    }
    uint8_t *map = NULL;
    if (fstat(fd, status) == 0 && S_ISREG(status->st_mode) && status->st_size > 0) {
        void *got = mmap(NULL, (size_t)status->st_size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        map = got == MAP_FAILED ? NULL : got;
    }
    close(fd);
    if (map != NULL && !layout_is_right(map, (size_t)status->st_size)) {
        static ino_t told;
        if (told != status->st_ino) {
            told = status->st_ino;
            fprintf(stderr, "gsense_board: %s is not a sensor bus (magic or sizes wrong): ignored\n", path);
        }
        munmap(map, (size_t)status->st_size);
        return NULL;
    }
    return map;
}

static bool is_same_file(const sensor_bus *bus, const struct stat *status)
{
    return bus->map != NULL && bus->device == status->st_dev && bus->inode == status->st_ino;
}

bool bus_poll(sensor_bus *bus, const chips *registers, uint64_t now_ns)
{
    struct stat status;
    if (stat(bus->path, &status) != 0 || is_same_file(bus, &status)) {
        return false;
    }
    uint8_t *map = map_file(bus->path, &status);
    if (map == NULL) {
        return false;
    }
    if (load(map + AT_HEARTBEAT) + BUS_SILENT_NS < now_ns) { /* left over from a simulation that has ended */
        munmap(map, (size_t)status.st_size);
        return false;
    }
    bus_close(bus);
    bus->map = map;
    bus->size = (size_t)status.st_size;
    bus->capacity = get(map + AT_CAPACITY, 4);
    bus->image_size = (size_t)get(map + AT_IMAGE_SIZE, 4);
    bus->device = status.st_dev;
    bus->inode = status.st_ino;
    bus->usable_from_ns = now_ns + CONFIGURATION_LATENCY_NS;
    bus_write_registers(bus, registers);
    return true;
}

bool bus_is_silent(const sensor_bus *bus, uint64_t now_ns)
{
    return load(bus->map + AT_HEARTBEAT) + BUS_SILENT_NS < now_ns;
}

static const uint8_t *slot(const sensor_bus *bus, uint64_t index)
{
    return bus->map + AT_IMAGES + (size_t)(index % bus->capacity) * bus->image_size;
}

static void take_bno(const uint8_t *raw, sensor_image *image)
{
    memcpy(image->bno, raw + IMAGE_AT_BNO, IMAGE_BNO_BYTES);
    image->bno_time_ns = get(raw + IMAGE_AT_BNO_TIME, 8);
}

static void take_image(const uint8_t *raw, sensor_image *image)
{
    image->time_ns = get(raw, 8);
    memcpy(image->mpu, raw + IMAGE_AT_MPU, IMAGE_MPU_BYTES);
    take_bno(raw, image);
    for (unsigned i = 0; i < IMAGE_LISY; ++i) {
        image->lisy[i] = (uint16_t)get(raw + IMAGE_AT_LISY + 2u * i, 2);
    }
    image->battery_mv = (uint16_t)get(raw + IMAGE_AT_BATTERY, 2);
}

bus_answer bus_image_at(const sensor_bus *bus, uint64_t time_ns, sensor_image *image)
{
    if (time_ns < bus->usable_from_ns) {
        return BUS_GONE;
    }
    const uint64_t count = load(bus->map + AT_COUNT);
    if (count == 0 || get(slot(bus, count - 1), 8) <= time_ns) {
        return BUS_NOT_YET;
    }
    const uint64_t oldest = count > bus->capacity - 1 ? count - (bus->capacity - 1) : 0;
    uint64_t index = count - 1;
    while (index > oldest && get(slot(bus, index), 8) > time_ns) {
        --index;
    }
    take_image(slot(bus, index), image);
    if (image->time_ns > time_ns) {
        return BUS_GONE;
    }
    /* Images are 1 ms apart; a BNO sample that came between this one and the read stands in the next. */
    const uint64_t next_sample = get(slot(bus, index + 1) + IMAGE_AT_BNO_TIME, 8);
    if (next_sample <= time_ns && next_sample > image->bno_time_ns) {
        take_bno(slot(bus, index + 1), image);
    }
    /* Not torn by the writer, who may already be at work on slot (count mod capacity). */
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    return load(bus->map + AT_COUNT) - index < bus->capacity ? BUS_FOUND : BUS_GONE;
}

void bus_write_registers(sensor_bus *bus, const chips *registers)
{
    if (bus->map == NULL) {
        return;
    }
    memcpy(bus->map + AT_MPU, registers->mpu, sizeof registers->mpu);
    memcpy(bus->map + AT_BNO_PAGE_0, registers->bno[0], sizeof registers->bno[0]);
    memcpy(bus->map + AT_BNO_PAGE_1, registers->bno[1], sizeof registers->bno[1]);
    __atomic_fetch_add((uint64_t *)(void *)(bus->map + AT_CONFIG_COUNT), 1, __ATOMIC_RELEASE);
}

void bus_close(sensor_bus *bus)
{
    if (bus->map != NULL) {
        munmap(bus->map, bus->size);
        bus->map = NULL;
    }
}
