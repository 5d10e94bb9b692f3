/* Directional derivatives of rates and signals with respect to states, inputs and parameters;
   algebraic variables satisfy g(y, d) = 0 along (dy, dd). */

#if CONSTRAINTS
static int directional(Instance *unit, const unsigned int *unknown, size_t n_unknown,
                       const unsigned int *known, size_t n_known, const double *seeds,
                       double *values)
{
    (void)unknown;
    (void)n_unknown;
    (void)known;
    (void)n_known;
    (void)seeds;
    (void)values;
    say(unit, "directional derivatives: not provided for mechanisms with loops");
    return 0;
}
#else
/* Return the index of a known among the unknowns of the equations, or N plus its index among
   parameters and inputs; -1 for other references. */
static int place_of_known(unsigned int reference)
{
    const int place = reference < REFERENCES ? (int)reference : 0;
    const int signal = place - OF_SIGNALS, u = signal - (NX + NZ);
    if (place >= OF_P && place < OF_RTOL) return N + place - OF_P;
    if (signal >= 0 && signal < NX && EXCHANGE) return signal;
    return u >= 0 && u < NU ? N + NP + u : -1;
}

/* Compute the derivatives along the seeds; return 0 on failure. */
static int directional(Instance *unit, const unsigned int *unknown, size_t n_unknown,
                       const unsigned int *known, size_t n_known, const double *seeds,
                       double *values)
{
    Memory *m = &unit->m;
    const char *missing = "";
    double y[N], along[N + ND], found[NX + NS + EQUATIONS];
    size_t k;
    if (!settled(unit)) return 0;
    unknowns(m, y);
    if (EXCHANGE || driven_otherwise(m)) missing = consistent(y, m->set, 0);
    if (*missing) {
        snprintf(unit->said, SAID, "%s: at t = %.9g s %s", MODEL_NAME, m->t, missing);
        return 0;
    }
    memset(along, 0, sizeof along);
    for (k = 0; k < n_known; ++k) {
        const int place = place_of_known(known[k]);
        if (place < 0) {
            snprintf(unit->said, SAID, "directional derivatives: expected inputs, parameters or "
                     "continuous states as knowns, got the value reference %u", known[k]);
            return 0;
        }
        along[place] += seeds[k];
    }
    model_along(&m->t, y, m->set, along, along + N, found);
#if EQUATIONS
    {
        double g[EQUATIONS], J[EQUATIONS * EQUATIONS];
        int i, j;
        model_equations(y, m->set, g, J);
        memcpy(g, found + NX + NS, sizeof g);
        if (!solved(EQUATIONS, J, g)) {
            say(unit, "directional derivatives: the algebraic equations are singular here");
            return 0;
        }
        for (i = 0; i < N; ++i) {
            for (j = 0; j < EQUATIONS; ++j) along[i] -= model_free[i + j * N] * g[j];
        }
        model_along(&m->t, y, m->set, along, along + N, found);
    }
#endif
    for (k = 0; k < n_unknown; ++k) {
        const int place = unknown[k] < REFERENCES ? (int)unknown[k] : 0;
        if (place >= OF_SIGNALS && place < OF_P) {
            values[k] = found[NX + place - OF_SIGNALS];
        } else if (place >= OF_RATES && place < OF_INDICATORS) {
            values[k] = found[place - OF_RATES];
        } else {
            snprintf(unit->said, SAID, "directional derivatives: expected outputs or rates as "
                     "unknowns, got the value reference %u", unknown[k]);
            return 0;
        }
    }
    return 1;
}
#endif
