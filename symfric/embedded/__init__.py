"""Generated C on Cortex-M cores: cross-compiled, run under QEMU, measured."""
