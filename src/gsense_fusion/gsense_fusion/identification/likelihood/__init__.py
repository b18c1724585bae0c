"""Windows whitened and block means under drift: how likely the data is under a model, and its best parameters."""
