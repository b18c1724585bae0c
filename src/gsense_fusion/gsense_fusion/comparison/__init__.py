"""What changed between two analyses: `snapshot` (a report as typed values) -> `differences` -> words, figures, page."""
