"""Bakes: `run` makes and runs them, `state` holds their status for panels, `out_of_date` finds those to repeat."""
