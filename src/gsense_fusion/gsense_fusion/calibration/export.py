"""The calibration in the layouts of Kalibr and OpenVINS.

Ours is written in the axes of the raw sensor: w = T (omega_m - G f) - b with the raw specific force f, and the true one
a = A (f - b_a); T = (I + M)^-1 of scale_misalignment. Both programs see the g-sensitivity of the *true* specific force
(at rest it points up, as ours does):

- Kalibr, model scale-misalignment: omega_m = M_g C w + A_g C a + b_g, a_m = M_a a + b_a, C = C_gyro_i.
- OpenVINS, model kalibr: w = R' D_w (omega_m - b_g - T_g a), a = D_a (a_m - b_a), R = R_IMUtoGYRO; its files hold
  T_w = D_w^-1 and T_a = D_a^-1.

So M_a = T_a = A^-1, M_g C = T_w R = T^-1 (split into a lower triangle and a rotation), T_g = G A^-1 = A_g C, and b_g is
T^-1 b + G b_a. Terms that do not follow the specific force linearly have no place there; the file's head says so.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from gsense_fusion.bags.topics import raw_topic
from gsense_fusion.compensation import CompensationFile, GSensitivity, ScaleMisalignment

FORMATS = ("kalibr", "openvins")
FloatArray = NDArray[np.float64]


def export(file: CompensationFile, name: str) -> str:
    """The YAML of a program.

    Args:
        file: what was calibrated.
        name: one of `FORMATS`.

    Raises:
        ValueError: no such format.
    """
    if name not in FORMATS:
        raise ValueError(f"{name}: no such format; there are {', '.join(FORMATS)}")
    m = _Matrices(file)
    document = _kalibr(file, m) if name == "kalibr" else _openvins(file, m)
    left = sorted({t.effect for t in file.terms} - {"g_sensitivity", "scale_misalignment"})
    left += ["time_offset"] if file.gyro_delay_s else []
    head = f"# {file.sensor}: biases (both programs estimate them) {_list(m.bias_g)} rad/s, {_list(m.bias_a)} m/s^2\n"
    head += f"# no place here for: {', '.join(left)}\n" if left else ""
    return head + yaml.safe_dump({"imu0": document}, sort_keys=False, default_flow_style=None, width=120)


class _Matrices:
    """The calibration as both programs' equations need it."""

    def __init__(self, file: CompensationFile) -> None:
        g = [np.array(t.full_matrix) for t in file.terms if isinstance(t, GSensitivity)]
        scale = [np.eye(3) + np.array(t.matrix) for t in file.terms if isinstance(t, ScaleMisalignment)]
        G = np.sum(g, axis=0) if g else np.zeros((3, 3))
        correction = file.accelerometer
        self.bias_a = np.zeros(3) if correction is None else np.array(correction.bias)
        self.accelerometer = np.eye(3) if correction is None else np.linalg.inv(np.array(correction.matrix))
        gyro = scale[0] if scale else np.eye(3)
        self.g = G @ self.accelerometer
        self.bias_g = gyro @ np.array(file.bias) + G @ self.bias_a
        # gyro = lower triangle times rotation: QR of the transpose, signs so that the diagonal is positive
        Q, R = np.linalg.qr(gyro.T)
        signs = np.diag(np.sign(np.diag(R)))
        self.gyro, self.turn = R.T @ signs, signs @ Q.T


def _kalibr(file: CompensationFile, m: _Matrices) -> dict[str, Any]:
    return {
        "model": "scale-misalignment",
        "rostopic": raw_topic(file.sensor),
        "T_i_b": _rows(np.eye(4)),
        "time_offset": 0.0,
        "accelerometers": {"M": _rows(m.accelerometer)},
        "gyroscopes": {"M": _rows(m.gyro), "A": _rows(m.g @ m.turn.T), "C_gyro_i": _rows(m.turn)},
    }


def _openvins(file: CompensationFile, m: _Matrices) -> dict[str, Any]:
    return {
        "model": "kalibr",
        "rostopic": raw_topic(file.sensor),
        "T_i_b": _rows(np.eye(4)),
        "time_offset": 0.0,
        "Tw": _rows(m.gyro),
        "R_IMUtoGYRO": _rows(m.turn),
        "Ta": _rows(m.accelerometer),
        "R_IMUtoACC": _rows(np.eye(3)),
        "Tg": _rows(m.g),
    }


def _rows(matrix: FloatArray) -> list[list[float]]:
    return [[float(x) for x in row] for row in matrix]


def _list(values: FloatArray) -> str:
    return "[" + ", ".join(f"{v:.6g}" for v in values) + "]"
