/* Equal steps of at most the constant length, into which a communication step is divided. */

static int steps_to(Memory *m, double end)
{
    const double begin = m->S[AT_T];
    const double parts = ceil((end - begin) / STEP_SIZE * (1.0 - 1e-9));
    const double h = (end - begin) / parts;
    double next[N], k;
    if (!(parts >= 1.0)) return 0;
    for (k = 1.0; k <= parts; k += 1.0) {
        model_step(m->S + MEMORY, &h, m->R + DATA, next);
        m->attempts += 1.0;
        if (!finite_all(next, N)) return TINY;
        memcpy(m->S + MEMORY, next, sizeof next);
        m->S[AT_T] = k < parts ? begin + k * h : end;
    }
    return 0;
}

/* Return the unknowns at the communication point. */
static void unknowns(const Memory *m, double *y)
{
    memcpy(y, m->S + MEMORY, N * sizeof(double));
}

/* Fixed steps never pass the communication point. */
static int returned(Memory *m)
{
    m->quiet = 0;
    return 0;
}
