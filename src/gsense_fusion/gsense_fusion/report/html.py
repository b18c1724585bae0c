"""report.html: one self-contained page."""

from __future__ import annotations

from jinja2 import Environment

from gsense_fusion.identification.result import LoopResult
from gsense_fusion.report.words import one_sentence

PAGE = "<!doctype html><html lang='en'><meta charset='utf-8'><title>{{ sentence }}</title><h1>{{ sentence }}</h1></html>\n"


def report_html(result: LoopResult) -> str:
    """The page as text."""
    return Environment(autoescape=True).from_string(PAGE).render(sentence=one_sentence(result))
