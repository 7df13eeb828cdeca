"""A page in the browser: one pass along a line, run anew whenever line, speed or policy is changed there."""
