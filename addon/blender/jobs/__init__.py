"""Bakes: `run` makes and runs them, `state` is what panels show of them, `out_of_date` tells which to repeat."""
