"""A block on the same inputs twice: as generated C, and in CasADi's virtual machine."""
