"""The files that close_loop leaves: report.json, report.html, compensation.yaml and a plan for what is open."""
