"""What to do with a report: in the order in which a person would."""

from __future__ import annotations

from gsense_fusion.identification.result import LoopResult
from gsense_fusion.report.next_plan import next_plan, undecided_plan
from gsense_fusion.report.words import correction, listing

UNEXPLAINED = (
    "what is unexplained has no name yet: its axes and frequencies are below, and an effect of your own is tried with "
    "close_loop --effects FILE.py"
)
COMPLETE = "use compensation.yaml in the fusion node; as far as these runs tell, nothing else is to be corrected"


def next_steps(result: LoopResult) -> list[str]:
    """One step each: rivals are told apart before anything is corrected; then what is unexplained, and left open."""
    rivals = [f for f in result.findings if f.alternatives]
    steps = []
    if rivals:
        names = " and ".join(f"{f.effect} from {listing(f.alternatives)}" for f in rivals)
        plan = next_plan(result) is not None
        steps.append(
            f"correct nothing for them before a campaign of next_plan.yaml has told {names}"
            if plan
            else f"correct nothing for them yet: these runs cannot tell {names}"
        )
    sure: dict[str, list[str]] = {}
    for finding in result.findings:
        if not finding.alternatives:
            sure.setdefault(correction(finding), []).append(finding.effect)
    steps += [f"for {listing(effects)}, {what}" for what, effects in sure.items()]
    if result.unexplained is not None:
        steps.append(UNEXPLAINED)
    if not steps:
        steps.append(COMPLETE)
    if undecided_plan(result) is not None:
        steps.append("a campaign of undecided_plan.yaml decides more of what these runs left open")
    return steps
