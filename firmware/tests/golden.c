#include "golden.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "cobs.h"
#include "frame.h"

static const char *separator;

static int16_t big_endian(const uint8_t *at) { return (int16_t)((unsigned)at[0] << 8 | at[1]); }
static int16_t little_endian(const uint8_t *at) { return (int16_t)((unsigned)at[1] << 8 | at[0]); }

static void print_hex(FILE *out, const char *name, const uint8_t *data, size_t length)
{
    fprintf(out, "\"%s\": \"", name);
    for (size_t i = 0; i < length; ++i) {
        fprintf(out, "%02x", data[i]);
    }
    fprintf(out, "\", ");
}

static void print_list(FILE *out, const char *name, const uint8_t *at, int16_t (*value)(const uint8_t *), unsigned count)
{
    fprintf(out, "\"%s\": [", name);
    for (unsigned i = 0; i < count; ++i) {
        fprintf(out, "%s%d", i == 0 ? "" : ", ", value(at + 2 * i));
    }
    fprintf(out, "], ");
}

/* Everything but the body's fields; the frame is closed here. */
static void print_head(FILE *out, const char *name, uint8_t *frame, const frame_header *header)
{
    uint8_t packet[COBS_PACKET_SIZE(FRAME_SIZE)];
    frame_close(frame, header);
    const size_t size = cobs_encode(frame, FRAME_SIZE, packet);
    fprintf(out, "%s    {\"name\": \"%s\", ", separator, name);
    separator = ",\n";
    print_hex(out, "hex", frame, FRAME_SIZE);
    print_hex(out, "packet", packet, size);
    fprintf(out, "\"version\": %u, \"type\": %u, \"flags\": %u, \"sequence\": %u, \"time_us\": %lu, \"fields\": {",
            FRAME_VERSION, header->type, header->flags, header->sequence, (unsigned long)header->time_us);
}

static void write_mpu(FILE *out, const char *name, const frame_header *header, const frame_mpu *body)
{
    uint8_t frame[FRAME_SIZE];
    frame_put_mpu(frame, body);
    print_head(out, name, frame, header);
    print_list(out, "acc", body->registers, big_endian, 3);
    print_list(out, "gyr", body->registers + 8, big_endian, 3);
    fprintf(out,
            "\"temperature\": %d, \"lisy_sum\": %u, \"battery_mv\": %u, \"radio_given_up\": %u, \"i2c_errors\": %u, "
            "\"retransmissions\": %u}}",
            big_endian(body->registers + 6), body->lisy_sum, body->battery_mv, body->radio_given_up, body->i2c_errors,
            body->retransmissions);
}

static void write_amg(FILE *out, const char *name, const frame_header *header, const frame_bno *body)
{
    uint8_t frame[FRAME_SIZE];
    frame_put_bno_amg(frame, body);
    print_head(out, name, frame, header);
    print_list(out, "acc", body->registers, little_endian, 3);
    print_list(out, "mag", body->registers + 6, little_endian, 3);
    print_list(out, "gyr", body->registers + 12, little_endian, 3);
    fprintf(out, "\"calib_stat\": %u, \"temperature\": %d, \"age_us\": %u}}", body->calib_stat, (int8_t)body->temperature,
            body->age_us);
}

static void write_ndof(FILE *out, const char *name, const frame_header *header, const frame_bno *body)
{
    uint8_t frame[FRAME_SIZE];
    frame_put_bno_ndof(frame, body);
    print_head(out, name, frame, header);
    print_list(out, "euler", body->registers, little_endian, 3);
    print_list(out, "quaternion", body->registers + 6, little_endian, 4);
    print_list(out, "linear_acceleration", body->registers + 14, little_endian, 3);
    fprintf(out, "\"calib_stat\": %u, \"temperature\": %d}}", body->calib_stat, (int8_t)body->temperature);
}

static void write_status(FILE *out, const char *name, const frame_header *header, const frame_status *s)
{
    uint8_t frame[FRAME_SIZE];
    frame_put_status(frame, s);
    print_head(out, name, frame, header);
    fprintf(out,
            "\"major\": %u, \"minor\": %u, \"mpu_dlpf_cfg\": %u, \"mpu_fs_sel\": %u, \"mpu_afs_sel\": %u, "
            "\"mpu_smplrt_div\": %u, \"bno_opr_mode\": %u, \"bno_acc_config\": %u, \"bno_gyr_config_0\": %u, "
            "\"bno_gyr_config_1\": %u, \"bno_mag_config\": %u, \"reset_cause\": %u, \"bno_unit_sel\": %u, "
            "\"mpu_period_us\": %u, \"bno_period_us\": %u, \"uptime_s\": %lu}}",
            s->major, s->minor, s->mpu_dlpf_cfg, s->mpu_fs_sel, s->mpu_afs_sel, s->mpu_smplrt_div, s->bno_opr_mode,
            s->bno_acc_config, s->bno_gyr_config_0, s->bno_gyr_config_1, s->bno_mag_config, s->reset_cause,
            s->bno_unit_sel, s->mpu_period_us, s->bno_period_us, (unsigned long)s->uptime_s);
}

/* Counting bytes: every byte's place shows. */
static void fill(uint8_t *registers, unsigned length, unsigned start, unsigned step)
{
    for (unsigned i = 0; i < length; ++i) {
        registers[i] = (uint8_t)(start + step * i);
    }
}

static void write_mpu_frames(FILE *out)
{
    static const uint8_t AT_REST[MPU_BURST] = {0xFF, 0xF0, 0x00, 0x10, 0x20, 0x00, 0xF0,
                                               0xB0, 0x00, 0x28, 0xFF, 0xE5, 0x00, 0x0C};
    uint8_t registers[MPU_BURST];
    frame_mpu body = {AT_REST, 8192, 3900, 0, 0, 0};
    write_mpu(out, "mpu_at_rest", &(frame_header){FRAME_MPU, 0, 1, 5000}, &body);
    fill(registers, MPU_BURST, 0x81, 7);
    body = (frame_mpu){registers, 16368, 4200, 1, 2, 15};
    write_mpu(out, "mpu_every_field", &(frame_header){FRAME_MPU, 0x06, 0xABCD, 0x12345678}, &body);
    memset(registers, 0, sizeof registers);
    body = (frame_mpu){registers, 0, 0, 255, 255, 0};
    write_mpu(out, "mpu_read_failed", &(frame_header){FRAME_MPU, FRAME_FLAG_READ_FAILED, 0xFFFF, 0xFFFFFFFF}, &body);
    memset(registers, 0xFF, sizeof registers);
    body = (frame_mpu){registers, 0xFFFF, 0xFFFF, 255, 255, 255};
    write_mpu(out, "mpu_all_ones", &(frame_header){FRAME_MPU, 0x07, 0, 0}, &body);
}

static void write_bno_frames(FILE *out)
{
    uint8_t registers[BNO_NDOF_BURST];
    fill(registers, sizeof registers, 0xF3, 11);
    frame_bno body = {registers, 0x3C, 0xE7, 0x1234};
    write_amg(out, "bno_amg", &(frame_header){FRAME_BNO_AMG, 0, 2, 7500}, &body);
    body = (frame_bno){registers, 0, 127, 65535};
    write_amg(out, "bno_amg_old_sample", &(frame_header){FRAME_BNO_AMG, 0x02, 256, 65536}, &body);
    body = (frame_bno){registers, 0xFF, 0x80, 0};
    write_ndof(out, "bno_ndof", &(frame_header){FRAME_BNO_NDOF, 0, 0x0100, 0x80000000}, &body);
}

static void write_status_frames(FILE *out)
{
    const frame_status usual = {0, 2, 3, 1, 1, 4, 7, 0x0D, 0x38, 0x00, 0x0B, 1, 0x00, 5000, 10000, 42};
    const frame_status other = {1, 254, 6, 3, 2, 255, 12, 0x0E, 0x3F, 0x01, 0x1B, 3, 0x82, 2000, 65535, 0xFEDCBA98};
    write_status(out, "status_default", &(frame_header){FRAME_STATUS, 0, 3, 1000000}, &usual);
    write_status(out, "status_every_field", &(frame_header){FRAME_STATUS, 0x02, 4, 2000000}, &other);
}

void golden_write(FILE *out)
{
    separator = "";
    fprintf(out, "{\"schema\": \"gsense-golden-frames/1\", \"frames\": [\n");
    write_mpu_frames(out);
    write_bno_frames(out);
    write_status_frames(out);
    fprintf(out, "\n]}\n");
}
