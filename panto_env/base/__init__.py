"""What every room may use: the one error, files, settings as data, the machine."""
