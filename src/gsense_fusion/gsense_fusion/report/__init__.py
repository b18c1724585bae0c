"""The files that close_loop leaves: report.json, report.html, compensation.yaml, next_plan.yaml."""
