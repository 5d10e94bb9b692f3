/* Model exchange: rates of the states at any state and time, with the algebraic equations solved.
   States of a mechanism may leave its constraints; rates are those at the nearest closed state and
   lead to it,

       x' = f(P x) + (P x - x) / PULL

   with the same solution as the equations if the constraints hold. */

#define PULL 0.02
#define SURELY 1e-9
/* Offset of an event indicator from its expression, so that the event has certainly occurred when
   the indicator changes its sign. */

/* Return the unknowns at the present time. */
static void unknowns(const Memory *m, double *y)
{
    memcpy(y, m->S + MEMORY, N * sizeof(double));
}

#if CROSSINGS
/* Give events that have occurred by the start the values just before them. */
static void before_start(Memory *m)
{
    int i;
    model_events(&m->begin, m->S + MEMORY, m->R + DATA, m->events);
    for (i = 0; i < CROSSINGS; ++i) {
        if (model_at_start[i] != 0.0) m->events[i] = model_at_start[i];
    }
}

static int passed(double before, double after, int direction)
{
    return (before < 0.0 && after >= 0.0 && direction >= 0)
        || (before > 0.0 && after <= 0.0 && direction <= 0);
}

/* Find the events that have occurred since the last update; return their number. */
static int happened(const Memory *m, const double *now, int surely, int *which)
{
    int i, count = 0;
    for (i = 0; i < CROSSINGS; ++i) {
        which[i] = passed(m->events[i], now[i], model_directions[i]) && (!surely || now[i] != 0.0);
        count += which[i];
    }
    return count;
}

/* Store the values that detect the next events; the value of an event that has occurred is kept
   while its expression is zero. */
static void looked_at(Memory *m, const double *now)
{
    int i;
    for (i = 0; i < CROSSINGS; ++i) {
        if (now[i] != 0.0) m->events[i] = now[i];
    }
}
#endif
