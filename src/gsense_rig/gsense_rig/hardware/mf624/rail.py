"""The real rail behind an MF624."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

from gsense_rig.hardware.interface import MOTOR_OFF, HardwareReading, MotorOutput
from gsense_rig.hardware.mf624.card import Card, CardPlace
from gsense_rig.hardware.mf624.wiring import Wiring
from gsense_rig.safety.modes import Light


class Mf624Rail:
    """Encoder, switches, current, bridge and traffic light on the card's terminals; the motor is off at the start.

    Args:
        card: an open card.
        wiring: its terminals.
        takeover: a second handle beside the loop's: resets nothing, and finds the outputs in an unknown state.
    """

    def __init__(self, card: Card, wiring: Wiring, takeover: bool = False) -> None:
        self.counts_per_metre = wiring.counts_per_metre
        self._card, self._wiring = card, wiring
        self._forward: bool | None = None  # level of DIR; None: unknown, or PWM not 0
        self._takeover = takeover
        card.check()
        if not takeover:
            card.start(self._levels(MOTOR_OFF, forward=False), wiring.encoder, wiring.encoder_filter)
            if wiring.current is not None:
                card.select(wiring.current)

    def now(self) -> float:
        """The card's time is the host's monotonic one [s]."""
        return time.monotonic()

    def read_counts(self) -> int:
        """Encoder alone."""
        counts = self._card.encoder(self._wiring.encoder)
        return -counts if self._wiring.encoder_reversed else counts

    def read(self) -> HardwareReading:
        """Read all inputs; the current is nan where it is not wired.

        Raises:
            HardwareError: the card does not answer.
        """
        w = self._wiring
        self._card.check()
        levels = self._card.read_inputs()

        def on(bit: int) -> bool:
            return bool(levels >> bit & 1) != w.switches_active_low

        current = math.nan
        if w.current is not None:
            current = (self._card.voltage() - w.current_zero) * w.amperes_per_volt
        return HardwareReading(
            self.read_counts(), (on(w.left), on(w.centre), on(w.right), on(w.optical)), current,
            bridge_ok=w.bridge_fault is None or bool(levels >> w.bridge_fault & 1),
            emergency_stop=w.emergency_stop is not None and bool(levels >> w.emergency_stop & 1),
        )  # fmt: skip

    def write(self, output: MotorOutput) -> None:
        """Write all outputs: DIS before PWM on the way off, PWM 0 around every change of DIR.

        Raises:
            HardwareError: the card does not answer; DIS was written all the same.
        """
        card, pwm = self._card, self._wiring.pwm
        if output.disabled:
            card.write_outputs(self._levels(output, forward=bool(self._forward)))
            card.force_low(pwm)
        else:
            forward = bool(self._forward) if output.duty == 0.0 else output.duty > 0.0
            if forward != self._forward:
                card.force_low(pwm)
            card.write_outputs(self._levels(output, forward))
            card.pwm(pwm, abs(output.duty))
            self._forward = forward
        card.check()

    def close(self) -> None:
        """Disable the motor, put out the light and unmap; a second handle only unmaps."""
        if not self._takeover:
            self._card.write_outputs(self._levels(MOTOR_OFF, forward=False))
            self._card.force_low(self._wiring.pwm)
        self._card.close()

    def _levels(self, output: MotorOutput, forward: bool) -> int:
        w = self._wiring
        lamp = {Light.GREEN: w.green, Light.AMBER: w.amber, Light.RED: w.red}.get(Light(output.light))
        levels = int(forward) << w.direction | int(output.disabled) << w.disable
        return levels if lamp is None else levels | 1 << lamp


@dataclass(frozen=True)
class CardRailSpec:
    """How loop and guard open the real rail; picklable."""

    place: CardPlace = field(default_factory=CardPlace)
    wiring: Wiring = field(default_factory=Wiring)

    def open(self) -> Mf624Rail:
        """Open it for the loop.

        Raises:
            HardwareError: no card, or it does not answer; the message is one line.
        """
        return Mf624Rail(Card(self.place.open(exclusive=True)), self.wiring)

    def fds(self) -> tuple[int, ...]:
        """Nothing is inherited: the guard maps the card itself."""
        return ()

    def open_guarded(self, owner: int) -> Mf624Rail:  # noqa: ARG002 - the simulation's handle needs it
        """Open the guard's own mapping.

        Raises:
            HardwareError: as `open`.
        """
        return Mf624Rail(Card(self.place.open()), self.wiring, takeover=True)
