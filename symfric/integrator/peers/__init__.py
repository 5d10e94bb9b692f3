"""Integrators of others on the same model, as a second opinion: CasADi's and SUNDIALS'."""
