"""What many gears have in common: which effects, and how often each one."""
