"""A pipeline fed from a port until its board is gone."""

from collections.abc import Callable

from gsense_driver.errors import PortLostError
from gsense_driver.pipeline import Pipeline, PipelineSettings
from gsense_driver.port import SerialPort


def read_all(port: SerialPort, alive: Callable[[], bool], now_ns: Callable[[], int]) -> Pipeline:
    pipeline = Pipeline(PipelineSettings())
    try:
        while (data := port.read()) or alive():
            pipeline.feed(data, now_ns())
    except PortLostError:
        pass
    port.close()
    return pipeline
