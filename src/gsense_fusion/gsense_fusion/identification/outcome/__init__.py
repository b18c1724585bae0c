"""The result of an analysis: parameters, findings, errors, arrays for the plots."""
