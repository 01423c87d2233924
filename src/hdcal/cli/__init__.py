"""What the commands share: options, console, processes."""
