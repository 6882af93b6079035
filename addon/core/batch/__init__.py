"""Options, report and file names of many bakes without a window."""
