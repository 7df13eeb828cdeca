"""An independent finite-element model of a pantograph on a flexible line, to compare the simulator with."""
