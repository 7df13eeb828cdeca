"""One tuner for all policies that have gains, and its command `panto tune`."""
