/* LISY300 and battery, by the ADC. */
#include <stdbool.h>

#include "battery.h"
#include "cmocka_all.h"
#include "fake_hal.h"
#include "lisy300.h"

static int setup(void **state)
{
    (void)state;
    fake_reset();
    return 0;
}

static void lisy_sums_16_conversions(void **state)
{
    (void)state;
    assert_int_equal(lisy300_sum(), 16 * 512);
    fake.adc[HAL_ADC_LISY] = 1023;
    assert_int_equal(lisy300_sum(), 16368);
}

static void battery_is_in_millivolt_and_low_with_hysteresis(void **state)
{
    (void)state;
    const struct {
        uint16_t code;
        uint16_t millivolt;
        bool low;
    } steps[] = {{605, 3899, false}, {515, 3319, false}, {511, 3294, true}, {520, 3352, true},
                 {528, 3403, false}, {0, 0, true},       {1023, 6594, false}};
    battery cell = {0, false};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; ++i) {
        fake.adc[HAL_ADC_BATTERY] = steps[i].code;
        battery_read(&cell);
        assert_int_equal(cell.millivolt, steps[i].millivolt);
        assert_int_equal(cell.low, steps[i].low);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(lisy_sums_16_conversions, setup),
        cmocka_unit_test_setup(battery_is_in_millivolt_and_low_with_hysteresis, setup),
    };
    return cmocka_run_group_tests_name("analogue", tests, NULL, NULL);
}
