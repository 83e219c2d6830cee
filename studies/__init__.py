"""What is measured: specs, trials, store, statistics and reports."""
