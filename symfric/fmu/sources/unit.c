/* Variables and initialisation of the unit, for both versions of the interface. Value references:
   0 time, then all signals, parameters, rtol, attempts; in model exchange also rates of the states
   and event indicators. */

enum { OF_SIGNALS = 1, OF_P = OF_SIGNALS + NS, OF_RTOL = OF_P + NP, OF_ATTEMPTS, OF_RATES };
enum { OF_INDICATORS = OF_RATES + EXCHANGE * NX, REFERENCES = OF_INDICATORS + EXCHANGE * CROSSINGS };

static void say(Instance *unit, const char *text) { snprintf(unit->said, SAID, "%s", text); }

static const char *const phase_names[] = {
    "before the initialisation", "in the initialisation", "during a simulation",
    "after its end", "after an error"
};

/* Set the tolerance; events of a model may limit it. */
static void tolerance(Memory *m, double rtol)
{
    int i;
    if (rtol > LARGEST_RTOL) rtol = LARGEST_RTOL;
    m->R[AT_RTOL] = rtol;
    for (i = 0; i < NX; ++i) m->R[FIXED + i] = ATOL * rtol * model_nominal[i];
}

/* Reset an instance. */
static void fresh(Memory *m)
{
    const int returns = m->returns;
    memset(m, 0, sizeof *m);
    m->returns = returns;
    m->kind = MODEL_KIND;
    m->stop = HUGE_VAL;
    m->R[AT_H_MAX] = LONGEST_STEP;
    tolerance(m, DEFAULT_RTOL);
    memcpy(m->set, model_data, sizeof m->set);
    memcpy(m->guess, model_guess, sizeof m->guess);
}

static double first_step(const Memory *m)
{
    const double least = SURE_STEP * fabs(m->begin);
    return FIRST_STEP > least ? FIRST_STEP : least;
}

/* Compute the start from the values that were set and those of the model, which may follow them. */
static const char *start(Memory *m)
{
    double *y = m->S + MEMORY, data[ND + 1];
    int i, own = m->begin != 0.0 || memcmp(m->set, model_data, sizeof m->set) != 0
              || memcmp(m->guess, model_guess, sizeof m->guess) != 0;
    const char *missing = "";
    for (i = 0; i < NX; ++i) own = own || m->chosen[i] > 0.0;
    memset(m->S, 0, sizeof m->S);
    m->S[AT_T] = m->begin;
    m->S[AT_H] = m->S[AT_H_OLD] = first_step(m);
    m->S[AT_GROWTH] = GROWTH_MEMORY;
    memcpy(data, m->set, sizeof data);
    memcpy(m->R + DATA, data, ND * sizeof(double));
    memcpy(y, model_start_values, N * sizeof(double));
    if (own) {
        model_start(m->known, m->chosen, data + NP, data, &m->begin, y);
        for (i = 0; i < NZ; ++i) y[model_place_of_z[i]] = m->guess[i];
#if TIMED
        y[N - 1] = m->begin;
#endif
        missing = consistent(y, m->R + DATA, 1);
#if EQUATIONS
        if (*missing) { /* again, from the unknowns at the start of the model */
            for (i = NX; i < N - TIMED; ++i) y[i] = model_start_values[i];
            missing = consistent(y, m->R + DATA, 1);
        }
#endif
    }
    m->t = m->begin;
    m->quiet = 1;
    m->stopped = 0;
    m->seen = m->rated = 0;
#if CROSSINGS
    before_start(m);
#endif
    m->settled = !*missing;
    return missing;
}

/* Begin the initialisation at a time, with an optional end; return 0 for bad arguments. */
static int initialise(Instance *unit, double begin, int limited, double stop, double rtol)
{
    Memory *m = &unit->m;
    if (!isfinite(begin) || (limited && !(stop > begin)) || !(rtol >= LEAST_RTOL && rtol <= 0.1)) {
        say(unit, "initialisation: expected a finite start time before the stop time, and a "
                  "tolerance from 1e-13 to 0.1");
        return 0;
    }
    m->begin = m->t = begin;
    m->limited = limited;
    m->stop = limited ? stop : HUGE_VAL;
    tolerance(m, rtol);
    m->settled = 0;
    return 1;
}

/* Make the start values consistent; return 0 on failure. */
static int settled(Instance *unit)
{
    Memory *m = &unit->m;
    const char *missing;
    if (m->settled || m->phase > INITIALISING) return 1;
    missing = start(m);
    if (*missing) snprintf(unit->said, SAID, "start of %s at t = %.9g s: %s", MODEL_NAME, m->t, missing);
    return !*missing;
}

static int driven_otherwise(const Memory *m)
{
    return memcmp(m->set, m->R + DATA, ND * sizeof(double)) != 0;
}

/* Compute all signals at the communication point with the inputs and parameters that are set; return
   0 if algebraic variables have no solution. */
static int look(Instance *unit)
{
    Memory *m = &unit->m;
    const char *missing = "";
    double y[N];
    if (m->seen) return 1;
    unknowns(m, y);
    if (EXCHANGE || driven_otherwise(m)) missing = consistent(y, m->set, 0);
    if (*missing) {
        snprintf(unit->said, SAID, "%s: at t = %.9g s %s", MODEL_NAME, m->t, missing);
        return 0;
    }
    model_signals(&m->t, y, m->set, m->out);
    m->seen = 1;
    return 1;
}

#if EXCHANGE
static int rated(Instance *unit);
#endif

/* Get the value of a variable; return 0 for an unknown reference or an inconsistent start. */
static int get(Instance *unit, unsigned int reference, double *value)
{
    Memory *m = &unit->m;
    if (reference >= REFERENCES) {
        snprintf(unit->said, SAID, "get: expected a value reference below %d, got %u", REFERENCES,
                 reference);
        return 0;
    }
    if (reference >= OF_SIGNALS && reference < OF_P) {
        if (!settled(unit) || !look(unit)) return 0;
        *value = m->out[reference - OF_SIGNALS];
#if EXCHANGE
    } else if (reference >= OF_RATES) {
        if (!settled(unit) || !rated(unit)) return 0;
        *value = m->rates[reference - OF_RATES];
#endif
    } else if (reference == 0) {
        *value = m->t;
    } else if (reference == OF_RTOL) {
        *value = m->R[AT_RTOL];
    } else {
        *value = reference == OF_ATTEMPTS ? m->attempts : m->set[reference - OF_P];
    }
    return 1;
}

/* Return 1 if a value is finite and within the range of its variable; else set a message. */
static int within(Instance *unit, const char *name, double value, double lower, double upper)
{
    if (isfinite(value) && value >= lower && value <= upper) return 1;
    snprintf(unit->said, SAID, "set %s: expected a finite number from %g to %g, got %g; the value is "
             "unchanged", name, lower, upper, value);
    return 0;
}

static Outcome set(Instance *unit, unsigned int reference, double value)
{
    Memory *m = &unit->m;
    const int place = reference < REFERENCES ? (int)reference : 0, signal = place - OF_SIGNALS;
    const int early = m->phase <= INITIALISING;
    if (signal >= NX + NZ && signal < NX + NZ + NU) {
        const int i = signal - (NX + NZ);
        if (!within(unit, model_signal_names[signal], value, -HUGE_VAL, HUGE_VAL)) return REFUSED;
        m->set[NP + i] = value;
    } else if (place >= OF_P && place < OF_RTOL) {
        const int i = place - OF_P;
        if (!within(unit, model_parameter_names[i], value, model_lower[i], model_upper[i])) {
            return REFUSED;
        }
        if (!early && model_fixed[i] && value != m->set[i]) {
            snprintf(unit->said, SAID, "set %s: expected a value before the end of the "
                     "initialisation, after which it is fixed; it is unchanged",
                     model_parameter_names[i]);
            return REFUSED;
        }
        m->set[i] = value;
    } else if (place == OF_RTOL) {
        if (!within(unit, "the relative tolerance", value, LEAST_RTOL, LARGEST_RTOL)) {
            return REFUSED;
        }
        tolerance(m, value);
    } else if (early && signal >= 0 && signal < NX) {
        if (!within(unit, model_signal_names[signal], value, -HUGE_VAL, HUGE_VAL)) return REFUSED;
        m->known[signal] = value;
        m->chosen[signal] = 1.0;
    } else if (early && signal >= 0 && signal < NX + NZ) {
        if (!within(unit, model_signal_names[signal], value, -HUGE_VAL, HUGE_VAL)) return REFUSED;
        m->guess[signal - NX] = value;
    } else {
        snprintf(unit->said, SAID, "set: expected an input or a parameter, or before the end of the "
                 "initialisation a start value, got the value reference %u", reference);
        return FAILED;
    }
    m->seen = m->rated = 0;
    if (early) m->settled = 0;
    return DONE;
}

/* Return the name of the last event, the first of several at the same time. */
static const char *last_event(const Memory *m)
{
#if CROSSINGS
    int i;
    for (i = 0; i < CROSSINGS; ++i) {
        if (m->jump[3 + 2 * N + i] > 0.0) return model_event_names[i];
    }
#endif
    (void)m;
    return "";
}

/* Set the message about steps that ended before the communication point. */
static void explain(Instance *unit, int why)
{
    Memory *m = &unit->m;
    double y[N], f[N];
    const double t = m->S[AT_T], h = m->S[AT_H];
    int i, fastest = 0, broken = -1;
    memcpy(y, m->S + MEMORY, sizeof y);
    model_rates(y, m->R + DATA, f);
    for (i = N - 1; i >= 0; --i) {
        if (!isfinite(f[i]) || !isfinite(y[i])) broken = i;
    }
    for (i = 1; i < NX; ++i) {
        if (fabs(f[i]) / model_nominal[i] > fabs(f[fastest]) / model_nominal[fastest]) fastest = i;
    }
    if (why == MANY) {
        snprintf(unit->said, SAID, "%s: stopped at t = %.9g s: more than %g steps in one communication "
                 "step; loosen rtol or look for a discontinuity", MODEL_NAME, t,
                 (double)MOST_ATTEMPTS);
    } else if (why == UNSOLVED) {
        snprintf(unit->said, SAID, "%s: stopped at t = %.9g s: after the event %s the algebraic "
                 "equations have no solution near their last one, or friction jams", MODEL_NAME, t,
                 last_event(m));
    } else if (why == STORM) {
        snprintf(unit->said, SAID, "%s: stopped at t = %.9g s: events pile up without time "
                 "advancing, the last one %s; give the model a mode in which the contact rests",
                 MODEL_NAME, t, last_event(m));
    } else if (broken >= 0) {
        snprintf(unit->said, SAID, "%s: stopped at t = %.9g s: the equation of %s returned NaN or "
                 "infinity; look for a division by zero or a root of a negative number there",
                 MODEL_NAME, t, model_unknown_names[broken]);
#if EQUATIONS
    } else if (jams(y, m->R + DATA)) {
        snprintf(unit->said, SAID, "%s: stopped at t = %.9g s: friction jams or a bearing would pull; "
                 "less friction, a longer bearing or a brake that does not lock itself would let it "
                 "move", MODEL_NAME, t);
#endif
    } else {
        snprintf(unit->said, SAID, "%s: stopped at t = %.9g s: the step fell to %.1e s, fastest "
                 "equation %s; a discontinuity is near, give the law a smooth form or the model an "
                 "event there", MODEL_NAME, t, h, model_unknown_names[fastest]);
    }
}
