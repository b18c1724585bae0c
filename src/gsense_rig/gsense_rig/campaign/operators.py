"""Who turns the board: a person at the terminal, or the simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters

from gsense_rig.campaign.crew import CampaignError
from gsense_rig.campaign.live_rig import ANSWER_WITHIN, LiveRig

WORDS = {
    "0": "flat, its arrow along the rail",
    "90": "flat, turned by 90 degrees about the vertical (to the left)",
    "180": "flat, turned by 180 degrees about the vertical",
    "tilt_x": "on its side, turned by 90 degrees about the rail",
    "tilt_y": "on end, turned by 90 degrees about the horizontal axis across the rail",
}
_RIG = "rig"


class Person:
    """Asks at the terminal and waits for Enter.

    Args:
        ask: shows a question and returns when it is answered; raises EOFError where nobody can answer.
    """

    at_hand = True

    def __init__(self, ask: Callable[[str], Any]) -> None:
        self._ask = ask

    def turn(self, mounting: str) -> None:
        """Says how the board shall sit."""
        self.confirm(f"Mount the board {WORDS[mounting]} (mounting {mounting}), and step back.")

    def confirm(self, question: str) -> None:
        """Waits for Enter."""
        try:
            self._ask(f"{question} Enter to go on, Ctrl-C to stop: ")
        except EOFError:
            raise CampaignError(
                "nobody is at the terminal to turn the board; with a simulated rig, use --yes"
            ) from None


class SimulatedPerson:
    """Turns the simulated board by the rig's parameter `mounting`."""

    at_hand = False

    def __init__(self, rig: LiveRig) -> None:
        self._rig = rig
        self._get = rig.node.create_client(GetParameters, f"{_RIG}/get_parameters")
        self._set = rig.node.create_client(SetParameters, f"{_RIG}/set_parameters")

    def check(self) -> None:
        """Raises CampaignError where the rig is not simulated: nobody may say yes for a person there."""
        request = GetParameters.Request(names=["hardware"])
        hardware = self._call(self._get, request).values[0].string_value
        if hardware != "sim":
            raise CampaignError(f"--yes is for hardware:=sim, and this rig's is {hardware!r}; leave it out")

    def turn(self, mounting: str) -> None:
        """Sets the parameter."""
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=mounting)
        request = SetParameters.Request(parameters=[ParameterMessage(name="mounting", value=value)])
        result = self._call(self._set, request).results[0]
        if not result.successful:
            raise CampaignError(f"the simulated board was not turned: {result.reason}")

    def confirm(self, question: str) -> None:
        """Nothing to ask."""

    def _call(self, client: Any, request: Any) -> Any:
        self._rig.wait(
            client.service_is_ready, ANSWER_WITHIN, f"no {client.srv_name}: is the rig node called {_RIG}? none"
        )
        future = client.call_async(request)
        self._rig.wait(future.done, ANSWER_WITHIN, f"no answer of {client.srv_name}")
        return future.result()
