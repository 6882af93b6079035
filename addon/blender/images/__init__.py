"""Where bakes are kept."""
