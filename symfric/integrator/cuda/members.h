/* Runs many members, one per thread: a thread whose member is done takes the next one, so that the
   threads of a warp make attempts together as long as members are waiting.

   This is valid C and CUDA C++. Required before it: `real`; DEVICE, BESIDE (a function that is not
   inlined) and TICKET (add one, return the old value); `symfric_attempt` (S, R -> next, D),
   `symfric_values` (t, y, d -> signals) and, if FOLLOWS is 2, `symfric_round` (y, d -> after,
   look); and all sizes: N unknowns, NX states, MEMORY rows of S before them, with T and H among
   these, SIZE_R rows of R, with T_END among them, N_D its last ones that are run data, ROWS of
   dense output (0: results at the ends of members only), SIGNALS, FLOOR. If FOLLOWS is 2, algebraic
   unknowns are updated after a jump of inputs in ROUNDS with DONE and CONTRACTION; if that fails,
   or FOLLOWS is 1, the member stops there.

   Time is a double in either type. If `real` is single (OWN_TIME), an attempt measures time from
   its own start, S[T] = 0, because t + h would lose the digits of a short h. TIMED: the last
   unknown is the time. */

enum { S_ROWS = MEMORY + N };
enum { ENDED = 0, RUNNING = 1, OUT_OF_ATTEMPTS = 2, TOO_SMALL = 3, SEARCH = 7, FRESH = 8 };

/* Common data, and data of members: entry i of member m at [i * members + m] by default. */
typedef struct {
    real *S;               /* columns S, advanced in place */
    const real *R;         /* run data, whose last n_data entries the input intervals fill */
    double *t;             /* time of each member */
    long long members;
    const double *breaks;  /* of the input intervals */
    long long intervals;
    const real *data;      /* (n_data, intervals), of member m from m * data_step on */
    long long n_data, data_step;
    const double *ends;    /* end time of each member */
    const double *h_min;   /* smallest step of each member */
    const double *times;   /* of results; at a break it belongs to the later interval */
    long long n_times, times_step, max_attempts;
    long long follow;      /* 1 if algebraic unknowns follow the data at the start, too */
    real *out;             /* signals, of member m from m * n_times * SIGNALS on */
    int *reason;
    long long *made;
    real *reach;           /* least and greatest states; on entry those of the start */
    int *interval, *next;  /* of each member: current input interval, next result */
    const int *todo;       /* members to continue */
    long long n_todo, budget;
    int *ticket;           /* number of them taken */
} Many;

typedef struct {
    real S[S_ROWS], R[SIZE_R], after[S_ROWS], D[ROWS * N + 1], least[NX + 1], most[NX + 1];
    double t, t_after, end; /* time, time after the attempt, end of the input interval */
    double h_min, due;      /* smallest step; time of the next result */
    long long left;         /* attempts still allowed */
    int member, interval, next;
} Thread;

static DEVICE const double *times_of(const Many *all, const Thread *x)
{
    return all->times + x->member * all->times_step;
}

/* Computes the next result, at a fraction of the step just made. */
static BESIDE void ask(const Many *all, Thread *x, double fraction)
{
    const real s = (real)fraction, t = (real)times_of(all, x)[x->next];
    real y[N + 1];
    for (int i = 0; i < N; ++i) {
#if ROWS
        real bend = 0;
        for (int r = ROWS - 1; r >= 0; --r) bend = x->D[r * N + i] + s * bend;
        y[i] = s == 0 ? x->S[MEMORY + i]
                      : (1 - s) * x->S[MEMORY + i]
                            + s * (x->after[MEMORY + i] + (1 - s) * bend);
#else
        y[i] = s == 0 ? x->S[MEMORY + i] : x->after[MEMORY + i];
#endif
    }
    symfric_values(&t, y, x->R + SIZE_R - N_D,
                   all->out + (x->member * all->n_times + x->next) * SIGNALS);
    ++x->next;
}

static DEVICE int is_last(const Many *all, const Thread *x)
{
    return x->interval + 1 >= all->intervals
           || all->breaks[x->interval + 1] >= all->ends[x->member];
}

/* Returns 1 if a result is due up to time t. */
static DEVICE int has_due(const Many *all, const Thread *x, double t)
{
    if (x->next >= all->n_times) return 0;
    const double due = times_of(all, x)[x->next];
    return due <= t && (is_last(all, x) ? due <= x->end : due < x->end);
}

static DEVICE void note_due(const Many *all, Thread *x)
{
    x->due = x->next < all->n_times ? times_of(all, x)[x->next] : HUGE_VAL;
}

/* Updates the algebraic unknowns to the run data; returns 0 on failure. */
static BESIDE int follow(Thread *x)
{
#if FOLLOWS == 2
    real now[N], after[N], look[3];
    for (int i = 0; i < N; ++i) now[i] = x->S[MEMORY + i];
    for (int k = 0; k < ROUNDS; ++k) {
        symfric_round(now, x->R + SIZE_R - N_D, after, look);
        if (!(look[1] <= DONE || look[1] <= CONTRACTION * look[0])) return 0;
        for (int i = 0; i < N; ++i) now[i] = after[i];
        if (look[1] <= DONE) {
            if (!(look[2] >= 0)) return 0;
            for (int i = 0; i < N; ++i) x->S[MEMORY + i] = now[i];
            return 1;
        }
    }
    return 0;
#else
    (void)x;
    return FOLLOWS != 1;
#endif
}

/* Sets the time of an attempt. */
static DEVICE void look_ahead(Thread *x)
{
#if OWN_TIME
    x->S[T] = 0;
    x->R[T_END] = (real)(x->end - x->t);
#if TIMED
    x->S[MEMORY + N - 1] = (real)x->t;
#endif
#else
    x->R[T_END] = x->end;
#endif
}

/* Sets end and data of the input interval. */
static DEVICE void take_data(const Many *all, Thread *x)
{
    const real *data = all->data + x->member * all->data_step;
    x->end = is_last(all, x) ? all->ends[x->member] : all->breaks[x->interval + 1];
    for (long long i = 0; i < all->n_data; ++i)
        x->R[SIZE_R - all->n_data + i] = data[i * all->intervals + x->interval];
    look_ahead(x);
}

/* Begins the input interval; returns 0 on failure. */
static BESIDE int enter(const Many *all, Thread *x)
{
    take_data(all, x);
    if ((x->interval || all->follow) && !follow(x)) return 0;
    while (has_due(all, x, x->t)) ask(all, x, 0.);
    note_due(all, x);
    return 1;
}

/* Stores the member, finished or not. */
static BESIDE void leave(const Many *all, Thread *x, int reason)
{
    const int m = x->member;
    for (int i = 0; i < S_ROWS; ++i) all->S[i * all->members + m] = x->S[i];
    for (int i = 0; i < NX; ++i) {
        all->reach[i * all->members + m] = x->least[i];
        all->reach[(NX + i) * all->members + m] = x->most[i];
    }
    all->t[m] = x->t;
    all->interval[m] = x->interval;
    all->next[m] = x->next;
    all->made[m] = all->max_attempts - x->left;
    all->reason[m] = reason;
    x->member = -1;
}

/* Takes the next member, if there is one. */
static BESIDE void fill(const Many *all, Thread *x)
{
    const int k = TICKET(all->ticket);
    if (k >= all->n_todo) {
        x->member = -2;
        return;
    }
    const int m = x->member = all->todo[k];
    for (int i = 0; i < S_ROWS; ++i) x->S[i] = all->S[i * all->members + m];
    for (int i = 0; i < SIZE_R; ++i) x->R[i] = all->R[i * all->members + m];
    for (int i = 0; i < NX; ++i) {
        x->least[i] = all->reach[i * all->members + m];
        x->most[i] = all->reach[(NX + i) * all->members + m];
    }
    x->t = all->t[m];
    x->h_min = all->h_min[m];
    x->left = all->max_attempts - all->made[m];
    x->interval = all->interval[m];
    x->next = all->next[m];
    if (all->reason[m] == RUNNING) {
        take_data(all, x);
        note_due(all, x);
    } else if (!enter(all, x)) {
        leave(all, x, SEARCH);
    }
}

static DEVICE int is_small(const Thread *x)
{
    const double h = (double)x->S[H];
    return !(h >= x->h_min && h >= FLOOR * fabs(x->t));
}

/* Goes to the next interval or the next member, until one can continue. */
static BESIDE void settle(const Many *all, Thread *x)
{
    while (x->member != -2) {
        if (x->member < 0) {
            fill(all, x);
        } else if (!(x->t < x->end)) {
            if (is_last(all, x)) {
                leave(all, x, ENDED);
            } else {
                ++x->interval;
                if (!enter(all, x)) leave(all, x, SEARCH);
            }
        } else if (is_small(x)) {
            leave(all, x, TOO_SMALL);
        } else if (x->left <= 0) {
            leave(all, x, OUT_OF_ATTEMPTS);
        } else {
            return;
        }
    }
}

/* Stores the results of an attempt. */
static DEVICE void take(const Many *all, Thread *x)
{
    --x->left;
#if OWN_TIME
    x->t_after = !(x->after[T] > 0) ? x->t
                 : x->after[T] == x->R[T_END] ? x->end : x->t + (double)x->after[T];
#else
    x->t_after = x->after[T];
#endif
    if (x->t_after > x->t) {
        for (int i = 0; i < NX; ++i) {
            const real now = x->after[MEMORY + i];
            if (now < x->least[i]) x->least[i] = now;
            if (now > x->most[i]) x->most[i] = now;
        }
        if (x->due <= x->t_after) {
            while (has_due(all, x, x->t_after))
                ask(all, x, (times_of(all, x)[x->next] - x->t) / (x->t_after - x->t));
            note_due(all, x);
        }
    }
    for (int i = 0; i < S_ROWS; ++i) x->S[i] = x->after[i];
    x->t = x->t_after;
    look_ahead(x);
    if (!(x->t < x->end) || is_small(x) || x->left <= 0) settle(all, x);
}

/* Runs one thread: attempts of one member after another, up to its budget. */
static DEVICE void symfric_thread(const Many *all)
{
    Thread x;
    x.member = -1;
    settle(all, &x);
    for (long long k = 0; k < all->budget && x.member >= 0; ++k) {
#if ROWS
        symfric_attempt(x.S, x.R, x.after, x.D);
#else
        symfric_attempt(x.S, x.R, x.after);
#endif
        take(all, &x);
    }
    if (x.member >= 0) leave(all, &x, RUNNING);
}
