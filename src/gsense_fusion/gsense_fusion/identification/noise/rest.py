"""The noise model of each axis from all windows at rest; from between the drive's orders where rest is too short."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.campaign import Campaign, RunData, Window
from gsense_fusion.identification.noise.spectrum import NoiseModel, fit_noise
from gsense_fusion.identification.types import AXES, BoolArray, FloatArray, IdentificationError

ENOUGH_REST_S = 30.0
MIN_WINDOW_S = 1.0
ORDERS_REMOVED = 12


def noise_at_rest(campaign: Campaign) -> tuple[dict[int, NoiseModel], tuple[str, ...]]:
    """Noise models by gyro axis, and notes on what they rest on."""
    still = [
        (r, w) for r in campaign.runs for w in r.windows if not w.moving and len(w) >= MIN_WINDOW_S * r.run.rate_hz
    ]
    rest_s = sum(len(w) / r.run.rate_hz for r, w in still)
    moving: list[tuple[RunData, Window]] = []
    notes: tuple[str, ...] = ()
    if rest_s < ENOUGH_REST_S:
        moving = [(r, w) for r in campaign.runs for w in r.windows if w.moving and r.run.has_rig]
        lack = f"only {rest_s:.0f} s of rest: the noise is estimated from between the drive's orders too"
        notes = (f"{lack}; record two minutes at rest",)
    models: dict[int, NoiseModel] = {}
    for axis in campaign.axes:
        windows = [r.run.angular_rate[w.start : w.stop, axis] for r, w in still]
        masks: list[BoolArray] = [np.ones((len(x) + 1) // 2 - 1, dtype=bool) for x in windows]
        for data, window in moving:
            series, mask = _between_orders(data, window, axis)
            windows.append(series)
            masks.append(mask)
        models[axis] = _whole(fit_noise(windows, campaign.rate_hz, masks), axis, campaign)
    tones = sorted({round(t.frequency_hz, 2) for m in models.values() for t in m.tones})
    if tones:
        notes += ("tones at rest, notched: " + ", ".join(f"{t:g} Hz" for t in tones[:8]),)
    return models, notes


def _whole(model: NoiseModel, axis: int, campaign: Campaign) -> NoiseModel:
    """The same; raises IdentificationError where the data holds no noise that a spectrum could be fitted to."""
    if not np.isfinite([model.white, model.flicker, model.walk, *model.shape]).all():
        raise IdentificationError(
            f"{campaign.runs[0].run.path}: the noise of gyro axis {AXES[axis]} at rest cannot be read: "
            "its values stand still, or are no numbers of a gyro; look at them, record again"
        )
    return model


def _between_orders(data: RunData, window: Window, axis: int) -> tuple[FloatArray, BoolArray]:
    """The rate without the drive's harmonics, and which ordinates lie clear of them."""
    series = data.run.angular_rate[window.start : window.stop, axis]
    n, rate = len(series), data.run.rate_hz
    frequency = np.fft.rfftfreq(n, 1 / rate)[1 : (n + 1) // 2]
    w = None if data.motion is None else data.motion.angular_frequency
    if w is None:
        return series, np.asarray(frequency > 5.0)
    t = np.arange(n) / rate
    orders = np.arange(1, ORDERS_REMOVED + 1) / 2.0
    phase = np.outer(t, w * orders)
    X = np.column_stack([np.ones(n), t, np.cos(phase), np.sin(phase)])
    beta, *_ = np.linalg.lstsq(X, series, rcond=None)
    clear = np.ones(len(frequency), dtype=bool)
    for order in orders:
        clear &= np.abs(frequency - order * w / (2 * np.pi)) > 2.5 * rate / n
    return series - X @ beta, clear
