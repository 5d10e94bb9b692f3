"""Problems as users write them: phases, conditions, costs, and their resolved form."""
