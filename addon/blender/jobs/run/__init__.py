"""From targets to jobs, and the three ways to run them: operator, engine and batch."""
