/* Steps with error control. While no input jumps, a step may pass the communication point, and its
   polynomial defines the values there. After a jump, the last step is repeated up to the point of
   the jump. */

#if CROSSINGS
/* Give events that have occurred by the start the values just before them. */
static void before_start(Memory *m)
{
    double now[CROSSINGS];
    int i, any = 0;
    memset(m->events, 0, sizeof m->events);
    m->events[TOLERANCE] = EVENT_TOLERANCE;
    model_events(&m->begin, m->S + MEMORY, m->R + DATA, now);
    for (i = 0; i < CROSSINGS; ++i) any = any || model_at_start[i] != 0.0;
    for (i = 0; i < CROSSINGS && any; ++i) {
        m->events[BEFORE + i] = model_at_start[i] != 0.0 ? model_at_start[i] : now[i];
    }
    if (any) m->events[PHASE] = JUMPED;
}
#endif

/* Record the accepted step from m->S to `next`, and search it for events. */
static void noted(Memory *m, double *next, const double *dense)
{
    memcpy(m->base, m->S, sizeof m->base);
    m->row[0] = m->S[AT_T];
    m->row[1] = next[AT_T];
    memcpy(m->row + 2, m->S + MEMORY, N * sizeof(double));
    memcpy(m->row + 2 + N, next + MEMORY, N * sizeof(double));
    memcpy(m->row + 2 + 2 * N, dense, ROWS * N * sizeof(double));
#if CROSSINGS
    memcpy(m->events_base, m->events, sizeof m->events_base);
    m->stopped = 0;
    m->happened = symfric_search(m->row, next, m->R, m->events, m->jump, 0, 0, 0, &m->stopped)
                  >= CUT;
#endif
}

/* Return 1 once for an event by `end` that has to end the communication step. */
static int to_report(Memory *m, double end)
{
    const int found = m->returns && m->happened && m->S[AT_T] <= end;
    if (found) m->happened = 0;
    return found;
}

/* Make steps up to `end` or beyond; return the reason of an earlier stop, or 0. */
static int steps_to(Memory *m, double end)
{
    double next[MEMORY + N], dense[ROWS * N];
    double most = m->attempts + MOST_ATTEMPTS;
    while (m->S[AT_T] < end) {
        if (m->stopped) return m->stopped;
        if (to_report(m, end)) return EVENT;
        if (!(m->S[AT_H] >= SMALLEST_STEP && m->S[AT_H] >= STEP_FLOOR * fabs(m->S[AT_T]))) {
            return TINY;
        }
        if (m->attempts >= most) return MANY;
        m->R[AT_END] = end;
        if (m->quiet) {
            m->R[AT_END] += 2.0 * m->S[AT_H];
            if (m->limited && m->R[AT_END] > m->stop) m->R[AT_END] = end > m->stop ? end : m->stop;
        }
        model_attempt(m->S, m->R, next, dense);
        m->attempts += 1.0;
        if (next[AT_T] > m->S[AT_T]) noted(m, next, dense);
        memcpy(m->S, next, sizeof next);
#if CROSSINGS && EQUATIONS
        if (m->stopped == FOLLOW) {
            m->stopped = *consistent(m->S + MEMORY, m->R + DATA, CLOSES) ? UNSOLVED : 0;
        }
#endif
    }
    if (m->stopped && m->S[AT_T] <= end) return m->stopped;
    return to_report(m, end) ? EVENT : 0;
}

/* Compute the unknowns at the communication point. */
static void unknowns(const Memory *m, double *y)
{
    const double *row = m->row;
    double s;
    int i, r;
    if (m->t >= m->S[AT_T]) {
        memcpy(y, m->S + MEMORY, N * sizeof(double));
        return;
    }
    s = (m->t - row[0]) / (row[1] - row[0]);
    for (i = 0; i < N; ++i) {
        double bend = 0.0;
        for (r = ROWS - 1; r >= 0; --r) bend = row[2 + 2 * N + r * N + i] + s * bend;
        y[i] = (1.0 - s) * row[2 + i] + s * (row[2 + N + i] + (1.0 - s) * bend);
    }
}

/* Return to the communication point, with the inputs and parameters used so far. */
static int returned(Memory *m)
{
    m->quiet = m->happened = 0;
    if (!(m->S[AT_T] > m->t)) return 0;
    memcpy(m->S, m->base, sizeof m->S);
    memcpy(m->events, m->events_base, sizeof m->events);
    m->stopped = 0;
    return steps_to(m, m->t);
}
