"""Where light arrives, where it comes from, and what stands in between."""
