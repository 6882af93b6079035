"""From targets to jobs, and the ways to run them."""
