/* Co-simulation: communication steps with inputs held. */

/* Apply the inputs and parameters that were set, at the communication point. */
static const char *jumped(Memory *m)
{
    const int moved = memcmp(m->set, m->R + DATA, NP * sizeof(double)) != 0;
    memcpy(m->R + DATA, m->set, ND * sizeof(double));
#if CROSSINGS
    if (m->events[PHASE] == ON) m->events[PHASE] = JUMPED;
#endif
    return consistent(m->S + MEMORY, m->R + DATA, moved);
}

/* Make a communication step from `from` to `from` + `size` [s] with inputs held. */
static Outcome advance(Instance *unit, double from, double size)
{
    Memory *m = &unit->m;
    const double end = from + size;
    const char *missing = "";
    int why;
    if (m->phase == ENDED) return OVER;
    if (!(isfinite(size) && fabs(from - m->t) <= 1e-6 * size + 1e-12 * fabs(from) && end > m->t)) {
        snprintf(unit->said, SAID, "%s: expected a communication step of more than 0 s from t = %.12g s "
                 "on, got %g s from %.12g s", MODEL_NAME, m->t, size, from);
        return REFUSED;
    }
    if (m->limited && end > m->stop + 1e-9 * fabs(m->stop) + 1e-6 * size) {
        snprintf(unit->said, SAID, "%s: expected no communication step beyond the stop time %.12g s, "
                 "got one to %.12g s", MODEL_NAME, m->stop, end);
        return REFUSED;
    }
    m->seen = 0;
    if (driven_otherwise(m)) {
        why = returned(m);
        if (!why) missing = jumped(m);
        if (*missing) {
            snprintf(unit->said, SAID, "%s: at t = %.9g s %s", MODEL_NAME, m->t, missing);
            return FAILED;
        }
    } else {
        why = 0;
        m->quiet = 1;
    }
    if (!why) why = steps_to(m, end);
    if (!why) {
        m->t = end;
        return DONE;
    }
    m->t = m->S[AT_T];
    if (why == EVENT) return m->t < end ? EARLY : DONE;
    if (why == TERMINAL) {
        m->phase = ENDED;
        snprintf(unit->said, SAID, "%s: the terminal event %s ended the simulation at t = %.9g s",
                 MODEL_NAME, last_event(m), m->t);
        return OVER;
    }
    explain(unit, why);
    return FAILED;
}
