/* Model exchange: rates of the states at any state and time; algebraic variables are solved for
   inside. States of a mechanism may leave its constraints: rates are those at the nearest state on
   them, and pull there,

       x' = f(P x) + (P x - x) / PULL

   with the same solution where the constraints hold. */

#define PULL 0.02
#define SURELY 1e-9
/* How far an event indicator lies beyond its expression, so that one that has changed its sign
   leaves no doubt about the event. */

/* Unknowns at the present time. */
static void unknowns(const Memory *m, double *y)
{
    memcpy(y, m->S + MEMORY, N * sizeof(double));
}

#if CROSSINGS
/* Events that have happened by the start have values as if just before it. */
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

/* Which events have happened since they were looked at last; how many. */
static int happened(const Memory *m, const double *now, int surely, int *which)
{
    int i, count = 0;
    for (i = 0; i < CROSSINGS; ++i) {
        which[i] = passed(m->events[i], now[i], model_directions[i]) && (!surely || now[i] != 0.0);
        count += which[i];
    }
    return count;
}

/* Values from which the next events are told; an event that took part keeps none while its
   expression is zero. */
static void looked_at(Memory *m, const double *now)
{
    int i;
    for (i = 0; i < CROSSINGS; ++i) {
        if (now[i] != 0.0) m->events[i] = now[i];
    }
}
#endif
