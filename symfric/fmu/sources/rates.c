/* Model exchange: functions that the integrator of the importer calls. */

/* Compute rates and event indicators at the present state, time and inputs; return 0 if algebraic
   variables have no solution. */
static int rated(Instance *unit)
{
    Memory *m = &unit->m;
    double *y = m->S + MEMORY, at[N], f[N];
    const char *missing;
    int i;
    if (m->rated) return 1;
    memcpy(m->R + DATA, m->set, ND * sizeof(double));
    memcpy(at, y, sizeof at);
#if CONSTRAINTS
    model_project(y, m->R + DATA, at);
#endif
    missing = consistent(at, m->R + DATA, 0);
    if (*missing) {
        snprintf(unit->said, SAID, "%s: at t = %.9g s %s", MODEL_NAME, m->t, missing);
        return 0;
    }
    model_rates(at, m->R + DATA, f);
    if (!finite_all(f, N)) {
        explain(unit, TINY);
        return 0;
    }
    for (i = NX; i < N - TIMED; ++i) y[i] = at[i]; /* initial guess of the next search */
    for (i = 0; i < NX; ++i) m->rates[i] = f[i] + (at[i] - y[i]) / PULL;
#if CROSSINGS
    model_events(&m->t, at, m->R + DATA, m->rates + NX);
    for (i = 0; i < CROSSINGS; ++i) {
        const double before = m->events[i];
        m->rates[NX + i] += before > 0.0 ? SURELY : before < 0.0 ? -SURELY : 0.0;
    }
#endif
    m->attempts += 1.0;
    m->rated = 1;
    return 1;
}

/* Set the time. */
static int at_time(Instance *unit, double t)
{
    Memory *m = &unit->m;
    if (!isfinite(t)) {
        say(unit, "set time: expected a finite number");
        return 0;
    }
    m->t = m->S[AT_T] = t;
#if TIMED
    m->S[MEMORY + N - 1] = t;
#endif
    m->seen = m->rated = 0;
    return 1;
}

/* Set the states. */
static int at_state(Instance *unit, const double *x, size_t n)
{
    Memory *m = &unit->m;
    if (n != NX || !finite_all(x, NX)) {
        snprintf(unit->said, SAID, "set states: expected %d finite numbers", NX);
        return 0;
    }
    memcpy(m->S + MEMORY, x, NX * sizeof(double));
    m->seen = m->rated = 0;
    return 1;
}

/* Return 1 if an event has occurred in the step that the importer has completed. */
static int completed(Instance *unit)
{
#if CROSSINGS
    Memory *m = &unit->m;
    double now[CROSSINGS];
    int which[CROSSINGS];
    if (!rated(unit)) return 0;
    model_events(&m->t, m->S + MEMORY, m->R + DATA, now);
    if (happened(m, now, 1, which)) return 1;
    looked_at(m, now);
    m->rated = 0;
#endif
    (void)unit;
    return 0;
}

/* Apply all events that have occurred; others may follow. Return DONE, OVER after a terminal event,
   or FAILED if algebraic variables have no solution. */
static Outcome carried_out(Instance *unit, int *again, int *moved)
{
    *again = *moved = 0;
#if CROSSINGS
    {
        Memory *m = &unit->m;
        double *y = m->S + MEMORY, now[CROSSINGS], resets[RESET_VALUES + 1];
        const char *missing;
        int which[CROSSINGS], i, over = 0;
        if (!rated(unit)) return FAILED;
        model_events(&m->t, y, m->R + DATA, now);
        *again = happened(m, now, m->stopped > 0, which) > 0;
        if (!*again) {
            looked_at(m, now);
            m->stopped = 0;
            m->rated = 0;
            return DONE;
        }
        model_resets(&m->t, y, m->R + DATA, resets);
        for (i = 0; i < RESET_VALUES; ++i) {
            if (!which[model_by_event[i]]) continue;
            y[model_of_state[i]] = resets[i];
            *moved = 1;
        }
        for (i = 0; i < CROSSINGS; ++i) {
            m->jump[3 + 2 * N + i] = which[i];
            over = over || (which[i] && model_terminal[i]);
            if (which[i]) m->events[i] = (double)NAN;
        }
        m->seen = m->rated = 0;
        m->stopped = 1; /* no event occurs twice at the same time */
        if (over) return OVER;
        missing = *moved ? consistent(y, m->R + DATA, CLOSES) : "";
        if (*missing) {
            explain(unit, UNSOLVED);
            return FAILED;
        }
    }
#endif
    (void)unit;
    return DONE;
}
