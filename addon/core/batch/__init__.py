"""Many bakes without a window."""
