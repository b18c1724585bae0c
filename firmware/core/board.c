#include "board.h"

#include <string.h>

#include "config.h"
#include "counters.h"
#include "hal.h"
#include "lisy300.h"

#define SECOND_US 1000000u
#define RADIO_AGAIN_US 1000u

/* Jobs without which the board is not alive. */
#define VITAL_JOBS ((1u << JOB_MPU) | (1u << JOB_BNO_READ) | (1u << JOB_STATUS) | (1u << JOB_VERIFY) | (1u << JOB_RADIO_VERIFY))

void board_init(board *b, const board_profile *profile, uint8_t bno_mode)
{
    memset(b, 0, sizeof *b);
    b->profile = profile;
    mpu6050_init(&b->mpu, &b->bus, &profile->mpu);
    bno055_init(&b->bno, &b->bus, &profile->bno);
    if (bno_mode != 0u) {
        b->bno.config.mode = bno_mode;
    }
    sample_clock_init(&b->bno_clock, BNO_GYRO_PERIOD_US);
    const uint32_t now = hal_micros();
    b->uptime_mark_us = now;
    scheduler_start(&b->slots, &profile->rates, now);
    scheduler_disarm(&b->slots, JOB_STATUS); /* the set-up of the MPU brings the first one; without it the first second does */
    scheduler_arm(&b->slots, JOB_MPU_SETUP, now + SETUP_RETRY_US);
    scheduler_arm(&b->slots, JOB_BNO_SETUP, now);
    nrf24_init(&b->radio, &radio_config, NRF24_TRANSMITTER);
    scheduler_arm(&b->slots, JOB_RADIO_SETUP, now);
    alive_init(&b->jobs, VITAL_JOBS, now);
}

static uint8_t flags(const board *b, bool failed)
{
    return (uint8_t)((failed ? FRAME_FLAG_READ_FAILED : 0u) | (b->uptime_s == 0u ? FRAME_FLAG_STARTED : 0u) |
                     (b->cell.low ? FRAME_FLAG_BATTERY_LOW : 0u));
}

/* A chip that is still being set up in the first second sends nothing; after that, frames that say "read failed". */
static bool worth_a_frame(const board *b, bool ready) { return b->announced && (ready || b->uptime_s != 0u); }

static void hand_over(board *b, uint8_t type, bool failed, uint32_t time_us)
{
    b->header.type = type;
    b->header.flags = flags(b, failed);
    b->header.sequence = b->sequence;
    b->header.time_us = time_us;
    frame_close(b->frame, &b->header);
    nrf24_make_room(&b->radio); /* waits only where retries made the frames before late */
    nrf24_send(&b->radio, b->frame);
    ++b->sequence; /* also where the radio gave it up at once: the gap tells of it */
}

static void run_mpu(board *b)
{
    if (!worth_a_frame(b, b->mpu.state == MPU_READY)) {
        return;
    }
    const uint32_t start = hal_micros();
    uint8_t *const registers = b->mpu_registers;
    hal_adc_start(); /* goes on during the burst */
    const bool good = mpu6050_read(&b->mpu, registers);
    const uint16_t lisy = lisy300_sum();
    battery_read(&b->cell);
    (void)nrf24_busy(&b->radio); /* books how the frame before went */
    b->mpu_body.registers = registers;
    b->mpu_body.lisy_sum = lisy;
    b->mpu_body.battery_mv = b->cell.millivolt;
    b->mpu_body.radio_given_up = b->radio.given_up;
    b->mpu_body.i2c_errors = b->bus.errors;
    b->mpu_body.retransmissions = b->radio.retransmissions;
    frame_put_mpu(b->frame, &b->mpu_body);
    hand_over(b, FRAME_MPU, !good, start);
}

static bool in_amg(const board *b) { return b->bno.config.mode == BNO_MODE_AMG; }

static void plan_look(board *b, uint32_t now)
{
    uint32_t next = sample_clock_next_look(&b->bno_clock);
    if (!time_reached(next, now)) {
        next = now;
    }
    scheduler_arm(&b->slots, JOB_BNO_LOOK, next);
}

/* What the sample needs besides its bytes: it waits for the slot after the burst's, which is too long for both. */
static uint16_t follow_samples(board *b)
{
    sample_clock_look(&b->bno_clock, b->bno_time_us, &b->bno_registers[BNO_GYR_IN_BURST]);
    const uint16_t age_us = sample_clock_age(&b->bno_clock, b->bno_time_us);
    plan_look(b, hal_micros());
    return age_us;
}

static void send_bno(board *b)
{
    if (!b->bno_pending) {
        return;
    }
    b->bno_pending = false;
    b->bno_body.registers = b->bno_registers;
    b->bno_body.calib_stat = b->bno.calib_stat;
    b->bno_body.temperature = b->bno.temperature;
    if (!in_amg(b)) {
        frame_put_bno_ndof(b->frame, &b->bno_body);
        hand_over(b, FRAME_BNO_NDOF, b->bno_failed, b->bno_time_us);
        return;
    }
    b->bno_body.age_us = 0;
    if (!b->bno_failed) {
        b->bno_body.age_us = follow_samples(b);
    }
    frame_put_bno_amg(b->frame, &b->bno_body);
    hand_over(b, FRAME_BNO_AMG, b->bno_failed, b->bno_time_us);
}

static void run_bno_read(board *b)
{
    if (b->bno_pending) { /* an older one has found no room yet: this slot is lost */
        b->slots.skipped = saturate_u16((uint32_t)b->slots.skipped + 1u);
        return;
    }
    if (!worth_a_frame(b, b->bno.state == BNO_READY)) {
        return;
    }
    b->bno_time_us = hal_micros();
    b->bno_failed = !bno055_read(&b->bno, b->bno_registers);
    b->bno_pending = true;
    scheduler_arm(&b->slots, JOB_BNO_SEND, b->bno_time_us);
}

static void run_bno_look(board *b)
{
    const uint32_t start = hal_micros();
    uint8_t gyro[BNO_GYR_BYTES];
    if (bno055_read_gyro(&b->bno, gyro)) {
        sample_clock_look(&b->bno_clock, start, gyro);
        plan_look(b, hal_micros());
    } /* else the next burst that succeeds plans the next look */
}

static void run_status(board *b)
{
    const mpu6050_config *mpu = &b->mpu.config;
    const bno055_config *bno = &b->bno.config;
    frame_status body;
    body.major = FIRMWARE_MAJOR;
    body.minor = FIRMWARE_MINOR;
    body.mpu_dlpf_cfg = mpu->dlpf_cfg;
    body.mpu_fs_sel = mpu->fs_sel;
    body.mpu_afs_sel = mpu->afs_sel;
    body.mpu_smplrt_div = mpu->smplrt_div;
    body.bno_opr_mode = bno055_mode(&b->bno);
    body.bno_acc_config = bno->acc_config;
    body.bno_gyr_config_0 = bno->gyr_config_0;
    body.bno_gyr_config_1 = bno->gyr_config_1;
    body.bno_mag_config = bno->mag_config;
    body.reset_cause = (uint8_t)hal_reset_cause();
    body.bno_unit_sel = bno->unit_sel;
    body.mpu_period_us = (uint16_t)b->profile->rates.period_us[JOB_MPU];
    body.bno_period_us = (uint16_t)b->profile->rates.period_us[JOB_BNO_READ];
    body.uptime_s = b->uptime_s;
    frame_put_status(b->frame, &body);
    hand_over(b, FRAME_STATUS, false, hal_micros());
    b->announced = true;
}

static void run_verify(board *b)
{
    (void)mpu6050_verify(&b->mpu); /* a mismatch shows in the chip's state and so in the frames' flags */
    (void)bno055_verify(&b->bno);
}

/* A set-up that has just ended is told at once: from here on the scales of STATUS hold. */
static void run_setup(board *b, uint8_t job)
{
    uint32_t wait;
    if (job == JOB_MPU_SETUP) {
        wait = mpu6050_setup_step(&b->mpu);
    } else {
        wait = bno055_setup_step(&b->bno);
    }
    const uint32_t now = hal_micros();
    if (wait != 0u) {
        scheduler_arm(&b->slots, job, now + wait);
        return;
    }
    if (job == JOB_BNO_SETUP) {
        sample_clock_init(&b->bno_clock, BNO_GYRO_PERIOD_US);
    }
    if (job == JOB_MPU_SETUP || b->announced) {
        scheduler_arm(&b->slots, JOB_STATUS, now);
    }
}

static void run_radio_setup(board *b)
{
    const uint32_t wait = nrf24_setup_step(&b->radio);
    if (wait != 0u) {
        scheduler_arm(&b->slots, JOB_RADIO_SETUP, hal_micros() + wait);
    }
}

/* Waits for a frame on the air where the one before got through at once (0.46 ms); else looks again later. */
static void run_radio_verify(board *b)
{
    if (nrf24_busy(&b->radio) && (b->radio.queued > 1u || b->radio.retransmissions != 0u)) {
        scheduler_arm(&b->slots, JOB_RADIO_VERIFY, hal_micros() + RADIO_AGAIN_US);
        return;
    }
    nrf24_finish(&b->radio);
    (void)nrf24_verify(&b->radio);
}

static void run_job(board *b, uint8_t job)
{
    switch (job) {
    case JOB_MPU:
        run_mpu(b);
        break;
    case JOB_BNO_READ:
        run_bno_read(b);
        break;
    case JOB_BNO_SEND:
        send_bno(b);
        break;
    case JOB_BNO_LOOK:
        run_bno_look(b);
        break;
    case JOB_STATUS:
        run_status(b);
        break;
    case JOB_BNO_HEALTH:
        (void)bno055_read_health(&b->bno);
        break;
    case JOB_VERIFY:
        run_verify(b);
        break;
    case JOB_RADIO_VERIFY:
        run_radio_verify(b);
        break;
    case JOB_RADIO_SETUP:
        run_radio_setup(b);
        break;
    case JOB_MPU_SETUP:
    case JOB_BNO_SETUP:
        run_setup(b, job);
        break;
    default:
        break;
    }
}

static void keep_time(board *b, uint32_t now)
{
    while ((uint32_t)(now - b->uptime_mark_us) >= SECOND_US) { /* once, but for a HAL that stood still */
        b->uptime_mark_us += SECOND_US;
        ++b->uptime_s;
        if (!b->announced) {
            scheduler_arm(&b->slots, JOB_STATUS, now);
        }
    }
}

/* Chips and a radio that fell out of READY get their set-up job back. */
static void mind_chips(board *b, uint32_t now)
{
    if (b->mpu.state != MPU_READY && !b->slots.armed[JOB_MPU_SETUP]) {
        scheduler_arm(&b->slots, JOB_MPU_SETUP, now);
    }
    if (b->bno.state != BNO_READY && !b->slots.armed[JOB_BNO_SETUP]) {
        scheduler_arm(&b->slots, JOB_BNO_SETUP, now);
    }
    if (b->radio.state != NRF24_READY && !b->slots.armed[JOB_RADIO_SETUP]) {
        scheduler_arm(&b->slots, JOB_RADIO_SETUP, now);
    }
}

uint32_t board_step(board *b)
{
    const uint32_t now = hal_micros();
    keep_time(b, now);
    const uint8_t job = scheduler_take(&b->slots, now);
    if (alive_check(&b->jobs, now)) {
        hal_watchdog_kick();
    }
    if (job == SCHEDULER_NONE) {
        return b->slots.next_us;
    }
    alive_ran(&b->jobs, job);
    run_job(b, job);
    const uint32_t end = hal_micros();
    mind_chips(b, end);
    return end;
}
