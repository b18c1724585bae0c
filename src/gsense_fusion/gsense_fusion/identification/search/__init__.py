"""Which effects explain the data: steps over groups of parameters, screens, intervals, rivals, chance."""
