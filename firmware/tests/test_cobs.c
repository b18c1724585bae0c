#include <string.h>

#include "cmocka_all.h"
#include "cobs.h"

#define LONGEST 1100u

static void round_trip(const uint8_t *data, size_t length)
{
    static uint8_t packet[COBS_PACKET_SIZE(LONGEST)];
    static uint8_t back[LONGEST + 8];
    const size_t size = cobs_encode(data, length, packet);
    assert_true(size >= length + 2);
    assert_true(size <= COBS_PACKET_SIZE(length));
    assert_int_equal(packet[size - 1], 0);
    assert_null(memchr(packet, 0, size - 1));
    assert_int_equal(cobs_decode(packet, size - 1, back), length);
    assert_memory_equal(back, data, length);
}

static void examples_of_the_paper(void **state)
{
    (void)state;
    const struct {
        size_t length;
        uint8_t data[5];
        uint8_t packet[8];
        size_t size;
    } examples[] = {
        {0, {0}, {1, 0}, 2},
        {1, {0}, {1, 1, 0}, 3},
        {2, {0, 0}, {1, 1, 1, 0}, 4},
        {4, {0x11, 0x22, 0, 0x33}, {3, 0x11, 0x22, 2, 0x33, 0}, 6},
        {4, {0x11, 0, 0, 0}, {2, 0x11, 1, 1, 1, 0}, 6},
    };
    for (size_t i = 0; i < sizeof examples / sizeof examples[0]; ++i) {
        uint8_t packet[8];
        assert_int_equal(cobs_encode(examples[i].data, examples[i].length, packet), examples[i].size);
        assert_memory_equal(packet, examples[i].packet, examples[i].size);
    }
}

static void every_length_comes_back(void **state)
{
    (void)state;
    static uint8_t data[LONGEST];
    uint32_t random = 7;
    for (unsigned kind = 0; kind < 4; ++kind) { /* no zeros, all zeros, few zeros, many zeros */
        for (size_t i = 0; i < LONGEST; ++i) {
            random = random * 1664525u + 1013904223u;
            const uint8_t value = (uint8_t)(random >> 24);
            data[i] = kind == 0 ? (uint8_t)(value | 1u) : kind == 1 ? 0 : kind == 2 ? value : (uint8_t)(value & 1u);
        }
        for (size_t length = 0; length <= LONGEST; ++length) {
            round_trip(data, length);
        }
    }
}

static void a_zero_at_every_place_of_a_long_run(void **state)
{
    (void)state;
    uint8_t data[520];
    for (size_t zero = 0; zero < sizeof data; ++zero) {
        memset(data, 0x5A, sizeof data);
        data[zero] = 0;
        round_trip(data, sizeof data);
        round_trip(data, zero + 1);
    }
}

static void a_frame_takes_34_bytes(void **state)
{
    (void)state;
    uint8_t frame[32];
    uint8_t packet[COBS_PACKET_SIZE(32)];
    memset(frame, 0, sizeof frame);
    assert_int_equal(cobs_encode(frame, sizeof frame, packet), 34);
    memset(frame, 0xFF, sizeof frame);
    assert_int_equal(cobs_encode(frame, sizeof frame, packet), 34);
}

static void bad_packets_are_refused(void **state)
{
    (void)state;
    uint8_t back[8];
    assert_int_equal(cobs_decode((const uint8_t[]){5, 1, 2}, 3, back), SIZE_MAX);
    assert_int_equal(cobs_decode((const uint8_t[]){3, 1, 0}, 3, back), SIZE_MAX);
    assert_int_equal(cobs_decode((const uint8_t[]){0, 1}, 2, back), SIZE_MAX);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(examples_of_the_paper),
        cmocka_unit_test(every_length_comes_back),
        cmocka_unit_test(a_zero_at_every_place_of_a_long_run),
        cmocka_unit_test(a_frame_takes_34_bytes),
        cmocka_unit_test(bad_packets_are_refused),
    };
    return cmocka_run_group_tests_name("cobs", tests, NULL, NULL);
}
