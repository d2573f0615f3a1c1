"""What the commands do: one module for each, a visible list of stages."""
