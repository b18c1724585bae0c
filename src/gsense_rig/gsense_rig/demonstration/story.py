"""The demonstration's story, step by step: graph, live run, campaign, closed loop, compensated orientation, reveal."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import yaml
from gsense_msgs.msg import Topics

from gsense_rig.campaign.index import Index, read_index
from gsense_rig.campaign.plan import load_plan
from gsense_rig.demonstration import start
from gsense_rig.demonstration.folder import DemoFolder
from gsense_rig.demonstration.graph import Listener, LiveGraph
from gsense_rig.demonstration.live_bag import check_bag
from gsense_rig.demonstration.options import Options
from gsense_rig.demonstration.orientation import LiveErrors, orientation_error, read_reference
from gsense_rig.demonstration.outcome import Outcome, compare, read_report
from gsense_rig.demonstration.processes import DemoError, Processes, ros_arguments
from gsense_rig.demonstration.reveal import Telling, reveal
from gsense_rig.demonstration.screen import Screen, Step
from gsense_rig.recording.bag import storage_file

AMPLITUDE, ANGULAR_FREQUENCY = 0.15, 7.0  # m, rad/s
SECOND_RUN = 8.0  # s
REST_BEFORE, REST_AFTER = 3.0, 1.0  # s at rest around a motion: the bias comes from there
SESSION_BEFORE = 3600.0  # s that the simulated campaign lies before the live run: a session of its own
PLAN = "demo"
RAW = Topics.MPU6050_IMU_RAW
PLAIN = f"{start.SENSOR}/{start.FILTER}/{Topics.IMU}"
COMPENSATED = f"{start.SENSOR}/{start.FILTER}{Topics.GCOMP_SUFFIX}/{Topics.IMU}"
_PATIENCE = 60.0  # s for what takes a second or two on an idle machine


@dataclass
class Figures:
    """What was measured on the way."""

    values: dict[str, Any] = field(default_factory=dict)

    def note(self, **values: Any) -> None:
        """Keeps figures, floats to six digits."""
        self.values |= {k: float(f"{v:.6g}") if isinstance(v, float) else v for k, v in values.items()}


class Story:
    """Tells it once; every process that it starts is one of `processes`."""

    def __init__(
        self, options: Options, folder: DemoFolder, processes: Processes, setting: start.Setting, live: start.Live
    ) -> None:
        self._options = options
        self._folder = folder
        self._processes = processes
        self._setting = setting
        self._live = live
        self._screen = Screen()
        self._figures = Figures()
        self._truth: dict[str, Any] = {}

    def tell(self) -> None:
        """The whole of it.

        Raises:
            DemoError: it cannot go on.
        """
        say = self._screen.say
        say(f"gsense demo, seed {self._options.seed}: the whole loop on a simulated rig (--seed repeats it)")
        say(
            "One of temperature_bias, rail_curvature and time_offset is hidden in the board; it is revealed at the end."
        )
        graph = LiveGraph(self._setting.domain, self._processes.check)
        try:
            self._first_sample(graph)
            self._home(graph)
            self._live_run(graph)
            index = self._campaign()
            sentence = self._close_loop(index)
            errors = self._second_run(graph)
        finally:
            graph.close()
        self._reveal(sentence, errors)

    def _first_sample(self, graph: LiveGraph) -> None:
        with self._screen.step("live graph") as step:
            step.show("rig, board and bridge are starting")
            graph.wait_for_sample(RAW, _PATIENCE)
            now = time.monotonic()
            self._live.fusion = start.start_fusion(self._processes)
            since_graph, since_command = now - self._setting.graph_begun, now - self._setting.command_begun
            self._figures.note(first_sample_s=since_graph, first_sample_since_command_s=since_command)
            step.done(
                f"first sample {since_graph:.1f} s after its start, {since_command:.1f} s after the command; "
                f"ROS_DOMAIN_ID={self._setting.domain}"
            )

    def _home(self, graph: LiveGraph) -> None:
        with self._screen.step("homing") as step:
            step.show("the carriage seeks its switches")
            graph.home(_PATIENCE)
            step.done("the encoder's zero is known")

    def _live_run(self, graph: LiveGraph) -> None:
        bag = self._folder.live_bag
        bag.parent.mkdir(parents=True, exist_ok=True)
        with self._screen.step("live run") as step:
            step.show("the recorder is starting")
            record = self._processes.start("gsense_rig", "record", *ros_arguments({"out": str(bag.absolute())}))
            for topic in (RAW, Topics.MPU6050_TEMPERATURE, Topics.LINK, Topics.RIG_POSE):
                graph.wait_for_subscriber(f"/{topic}", "record", _PATIENCE)
            error = self._drive(graph, step, self._options.seconds)
            code = self._processes.stop(record)
            if code != 0:
                raise DemoError(f"the recorder ended with exit code {code}: {record.last_words()} ({record.log})")
            found = check_bag(bag, f"/{RAW}")
            lost = graph.link.lost if graph.link is not None else 0
            self._figures.note(
                frames=int(graph.link.received) if graph.link is not None else 0,
                frames_lost=int(lost),
                bag_messages=found.messages,
                bag_samples=found.samples,
                bag_samples_missing=found.missing,
                tracking_rms_m=error,
            )
            step.done(
                f"{found.samples} samples in {found.seconds:.1f} s, "
                f"{found.missing} missing{_why(found.missing, lost)}, {lost} frames lost; "
                f"tracking {error * 1e3:.2f} mm rms; bag closed with {found.messages} messages"
            )

    def _drive(self, graph: LiveGraph, step: Step, seconds: float) -> float:
        """Rest, the sinusoid, rest; returns its tracking error in m."""
        step.show("at rest")
        graph.rest(REST_BEFORE)
        cycles = max(1, round(seconds * ANGULAR_FREQUENCY / (2 * math.pi)))

        def feedback(elapsed: float, position: float) -> None:
            link, state = graph.link, graph.state
            frames = f"{link.received} frames, {link.lost} lost" if link is not None else "no link status yet"
            error = f"{abs(state.tracking_error) * 1e3:4.2f} mm" if state is not None else "?"
            step.show(
                f"{position * 1e3:+4.0f} mm, tracking error {error}; {frames}", min(1.0, elapsed / max(seconds, 1e-3))
            )

        error = graph.drive(AMPLITUDE, ANGULAR_FREQUENCY, cycles, feedback)
        step.show("at rest")
        graph.rest(REST_AFTER)
        return error

    def _campaign(self) -> Index:
        """The rest of a short campaign with the same unit and effect, an hour before the live run."""
        plan, folder, seed = load_plan(PLAN), self._folder.campaign, self._options.seed
        with self._screen.step("campaign") as step:
            begun = time.monotonic()
            simulate = self._processes.start(
                "gsense_rig",
                "simulate",
                *(PLAN, "--out", str(folder), "--effect", self._live.hidden.argument, "--unit-id", self._live.unit_id),
                *("--seed", str(seed + 1), "--unit-seed", str(seed)),
                *("--start-time", str(round(time.time() - SESSION_BEFORE))),
            )

            def meanwhile() -> None:
                made = sum(storage_file(bag).is_file() for bag in folder.glob("run_*"))
                step.show(f"{made} of {len(plan.runs)} runs simulated", made / len(plan.runs))
                time.sleep(0.1)

            self._run(simulate, meanwhile)
            truth = folder / "truth.yaml"  # kept from the loop until the end
            self._truth = yaml.safe_load(truth.read_text(encoding="utf-8"))
            truth.unlink()
            seconds = time.monotonic() - begun
            self._figures.note(campaign_s=seconds, campaign_simulated_s=plan.duration)
            step.done(
                f"{len(plan.runs)} runs of the same unit, {plan.duration:.0f} s of motion and rest, simulated "
                f"{plan.duration / seconds:.0f} times faster than real time"
            )
        return read_index(folder)

    def _close_loop(self, index: Index) -> str:
        """Fit, select, judge on held-out runs; returns the verdict in one sentence."""
        bags = {
            role: [str(self._folder.campaign / e.bag) for e in index.runs if e.plan.role == role]
            for role in ("fit", "held_out")
        }
        fit, held_out = [str(self._folder.live_bag), *bags["fit"]], bags["held_out"]
        with self._screen.step("closed loop") as step:
            step.show(f"fitting {len(fit)} runs, judging on {len(held_out)} others")
            close = self._processes.start(
                "gsense_fusion",
                "close_loop",
                *("--fit", *fit, "--held-out", *held_out),
                *("--sensor", start.SENSOR, "--out", str(self._folder.report)),
            )
            begun = time.monotonic()
            self._run(close, lambda: time.sleep(0.1))
            self._figures.note(close_loop_s=time.monotonic() - begun)
            report = read_report(self._folder.report / "report.json")
            names = ", ".join(finding["effect"] for finding in report["findings"]) or "nothing"
            step.done(f"{len(fit)} runs fitted, judged on {len(held_out)} others: names {names}")
        return _sentence(close.log.read_text(encoding="utf-8", errors="replace"))

    def _run(self, child: Any, meanwhile: Any) -> None:
        code = self._processes.wait(child, meanwhile, 300.0)
        if code != 0:
            raise DemoError(f"{child.name} ended with exit code {code}: {child.last_words()} ({child.log})")

    def _second_run(self, graph: LiveGraph) -> LiveErrors:
        """The fusion node again, now with what the loop wrote; errors without and with it."""
        with self._screen.step("compensated") as step:
            step.show("the fusion node starts again with compensation.yaml")
            if self._live.fusion is not None:
                self._processes.stop(self._live.fusion)
            epoch = float(int(time.time()))
            listener = graph.listen((PLAIN, COMPENSATED))
            self._live.fusion = start.start_fusion(self._processes, self._folder.report / "compensation.yaml")
            graph.wait(lambda: listener.count() > 0, _PATIENCE, f"message on {COMPENSATED}")
            begun = time.time() - epoch + REST_BEFORE
            self._drive(graph, step, SECOND_RUN)
            stop = time.time() - epoch - REST_AFTER
            listener.close()
            errors = self._judge(listener, epoch, begun, stop)
            self._figures.note(
                live_rate_before=errors.before.rate,
                live_rate_after=errors.after.rate,
                live_rate_after_less_reference=errors.less_reference,
                live_tilt_before=errors.before.tilt,
                live_tilt_after=errors.after.tilt,
            )
            step.done(f"{listener.count()} orientations with the file that the loop wrote, from the live node")
        return errors

    def _judge(self, listener: Listener, epoch: float, start_s: float, stop_s: float) -> LiveErrors:
        plain, compensated = (listener.track(topic, epoch) for topic in (PLAIN, COMPENSATED))
        report = read_report(self._folder.report / "report.json")
        delays = [run["encoder_delay_s"] for run in report["runs"] if run["encoder_delay_s"] is not None]
        delay = float(np.median(delays)) if delays else 0.0
        reference = read_reference(self._folder.report / "compensation.yaml")
        try:
            less: float | None = None
            if reference is not None:
                turning = reference.rate(*listener.motion(epoch), compensated.time - delay)
                corrected = replace(compensated, rate=compensated.rate - turning)
                less = orientation_error(corrected, start_s, stop_s).rate
            return LiveErrors(
                orientation_error(plain, start_s, stop_s), orientation_error(compensated, start_s, stop_s), less
            )
        except ValueError as error:
            raise DemoError(str(error)) from error

    def _reveal(self, sentence: str, errors: LiveErrors) -> None:
        hidden, folder = self._live.hidden, self._folder
        outcome: Outcome = compare(read_report(folder.report / "report.json"), hidden)
        truth = {"effect": hidden.kind.name, "value": hidden.value, "unit": hidden.kind.unit}
        folder.write(folder.hidden, {"seed": self._options.seed, **truth, "unit_under_test": self._truth})
        now = time.monotonic()
        self._figures.note(
            wall_s=now - self._setting.graph_begun, wall_since_command_s=now - self._setting.command_begun
        )
        folder.write(
            folder.summary,
            {
                "seed": self._options.seed,
                "state": "done",
                "hidden": truth,
                "found": list(outcome.found),
                "hidden_found": outcome.hidden_found,
                "deviation_sigma": outcome.deviation,
                "verdict": outcome.verdict,
                "rate_rms": dict(outcome.rate_rms),
                "figures": self._figures.values,
            },
        )
        reveal(Telling(outcome, hidden, sentence, errors, self._figures.values, folder))


def _sentence(log: str) -> str:
    """The verdict: close_loop's first line with a colon; its own progress is not in it."""
    return next((line.strip() for line in log.split("\n") if line.startswith(start.SENSOR)), "")


def _why(missing: int, lost: int) -> str:
    """What is said of samples for which no frame was lost."""
    return " (this machine is too busy for real time)" if missing > lost else ""
