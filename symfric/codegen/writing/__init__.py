"""Header and source file of a block."""
