#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cmocka_all.h"
#include "crc16.h"
#include "frame.h"
#include "golden.h"

/* The definition, bit by bit: the oracle for the fast form. */
static uint16_t slow_crc(const uint8_t *data, size_t length)
{
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < length; ++i) {
        crc = (uint16_t)(crc ^ (unsigned)data[i] << 8);
        for (int bit = 0; bit < 8; ++bit) {
            crc = (uint16_t)((crc & 0x8000u) != 0 ? ((unsigned)crc << 1) ^ 0x1021u : (unsigned)crc << 1);
        }
    }
    return crc;
}

static void crc_has_the_published_check_value(void **state)
{
    (void)state;
    assert_int_equal(crc16((const uint8_t *)"123456789", 9), 0x29B1);
    assert_int_equal(crc16((const uint8_t *)"", 0), 0xFFFF);
}

static void crc_equals_the_bitwise_definition(void **state)
{
    (void)state;
    uint8_t data[255];
    uint32_t random = 1;
    for (size_t i = 0; i < sizeof data; ++i) {
        random = random * 1664525u + 1013904223u;
        data[i] = (uint8_t)(random >> 24);
    }
    for (unsigned length = 0; length <= 255; ++length) {
        assert_int_equal(crc16(data, (uint8_t)length), slow_crc(data, length));
    }
}

static void header_and_crc_stand_at_their_offsets(void **state)
{
    (void)state;
    const uint8_t registers[MPU_BURST] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
    const frame_mpu body = {registers, 0x1122, 0x3344, 0x55, 0x66, 0x77};
    const frame_header header = {FRAME_MPU, 0x05, 0xA1B2, 0xC3D4E5F6};
    const uint8_t expected[FRAME_CRC] = {0x21, 0x05, 0xB2, 0xA1, 0xF6, 0xE5, 0xD4, 0xC3, 1,    2,    3,    4,    5,    6,    7,
                                         8,    9,    10,   11,   12,   13,   14,   0x22, 0x11, 0x44, 0x33, 0x55, 0x66, 0x77, 0};
    uint8_t frame[FRAME_SIZE];
    frame_put_mpu(frame, &body);
    frame_close(frame, &header);
    assert_memory_equal(frame, expected, FRAME_CRC);
    assert_int_equal(frame[30] | frame[31] << 8, slow_crc(expected, FRAME_CRC));
}

static void a_flipped_bit_is_seen(void **state)
{
    (void)state;
    const uint8_t registers[BNO_NDOF_BURST] = {9, 8, 7};
    const frame_bno body = {registers, 1, 2, 3};
    uint8_t frame[FRAME_SIZE];
    frame_put_bno_amg(frame, &body);
    frame_close(frame, &(frame_header){FRAME_BNO_AMG, 0, 1, 2});
    assert_true(frame_is_sound(frame));
    for (unsigned bit = 0; bit < FRAME_SIZE * 8; ++bit) {
        frame[bit / 8] = (uint8_t)(frame[bit / 8] ^ 1u << bit % 8);
        assert_false(frame_is_sound(frame));
        frame[bit / 8] = (uint8_t)(frame[bit / 8] ^ 1u << bit % 8);
    }
}

static void another_version_is_not_sound(void **state)
{
    (void)state;
    uint8_t frame[FRAME_SIZE] = {0};
    frame[0] = 2u << 5 | FRAME_MPU;
    const uint16_t crc = crc16(frame, FRAME_CRC);
    frame[30] = (uint8_t)(crc & 0xFF);
    frame[31] = (uint8_t)(crc >> 8);
    assert_false(frame_is_sound(frame));
}

static void the_core_still_makes_the_golden_frames(void **state)
{
    (void)state;
    char *made = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&made, &size);
    golden_write(out);
    fclose(out);
    FILE *in = fopen(GOLDEN_FILE, "r");
    assert_non_null(in);
    char *kept = calloc(1, size + 2);
    const size_t read = fread(kept, 1, size + 1, in);
    fclose(in);
    assert_int_equal(read, size);
    assert_string_equal(kept, made);
    free(kept);
    free(made);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crc_has_the_published_check_value),
        cmocka_unit_test(crc_equals_the_bitwise_definition),
        cmocka_unit_test(header_and_crc_stand_at_their_offsets),
        cmocka_unit_test(a_flipped_bit_is_seen),
        cmocka_unit_test(another_version_is_not_sound),
        cmocka_unit_test(the_core_still_makes_the_golden_frames),
    };
    return cmocka_run_group_tests_name("frame", tests, NULL, NULL);
}
