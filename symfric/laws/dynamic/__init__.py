"""Laws with internal states."""
