/* Runs many members, LANES at a time: as soon as one is done, the next takes its lane.

   Required before this: `lanes.h`, `symfric_step` (S, R -> S_next, D) and `symfric_values` (t, y,
   d -> signals) on vectors, with WORK work vectors, and all sizes: N unknowns, MEMORY rows of S
   before them, with T and H among these, SIZE_R rows of R, with T_END among them, N_D its last ones
   that are run data, ROWS of dense output, SIGNALS, FLOOR. If FOLLOWS is 2, `symfric_follow`
   updates algebraic unknowns after a jump of inputs; if that fails, or FOLLOWS is 1, the member
   stops there. */

enum { S_ROWS = MEMORY + N };
enum { ENDED = 0, OUT_OF_ATTEMPTS = 2, TOO_SMALL = 3, SEARCH = 7 };

/* Data of all members; those of member m begin at m times _step. */
typedef struct {
  double *S;             /* start columns, advanced in place */
  const double *R;       /* run data, whose last n_data entries the input intervals fill */
  long long members;
  const double *breaks;  /* of the input intervals */
  long long intervals;
  const double *data;    /* (n_data, intervals) */
  long long n_data, data_step;
  const double *ends;    /* end time of each member */
  const double *h_min;   /* smallest step of each member */
  const double *times;   /* of results; at a break it belongs to the later interval */
  long long n_times, times_step, max_attempts;
  long long follow;      /* 1 if algebraic unknowns follow the data at the start, too */
  double *out;           /* signals, NaN after a member stopped */
  long long *reason, *made;
  double *reach;         /* least and greatest unknowns; on entry those of the start */
} Many;

/* Data of all lanes: the next member, the number of busy lanes, and pending results, which are
   computed when there are as many as lanes. */
typedef struct {
  long long waiting, running, ready;
  V t, y[N], d[N_D + 1], values[SIGNALS + 1];
  double *place[LANES];
  V *work;
} Common;

/* Group of lanes: each runs a member, or none (-1) and repeats another lane. */
typedef struct {
  Common *common;
  V S[S_ROWS], R[SIZE_R], after[S_ROWS], D[ROWS * N + 1], least[N], most[N];
  V h_min, due;          /* smallest step; time of the next result */
  I left;                /* attempts still allowed */
  long long member[LANES], interval[LANES], next[LANES];
} Lanes;

static void give(Common *x)
{
  const V *arg[3] = {&x->t, x->y, x->d};
  V *res[1] = {x->values};
  symfric_values(arg, res, x->work);
  for (long long k = 0; k < x->ready; ++k)
    for (int i = 0; i < SIGNALS; ++i) x->place[k][i] = x->values[i][k];
  x->ready = 0;
}

static const double *times_of(const Many *all, const Lanes *x, int l)
{
  return all->times + x->member[l] * all->times_step;
}

/* Requests the next result of lane l, at the fraction s of the step just made. */
static void ask(const Many *all, Lanes *x, int l, double s)
{
  Common *to = x->common;
  const long long k = to->ready++, next = x->next[l]++;
  to->t[k] = times_of(all, x, l)[next];
  to->place[k] = all->out + (x->member[l] * all->n_times + next) * SIGNALS;
  for (int i = 0; i < N_D; ++i) to->d[i][k] = x->R[SIZE_R - N_D + i][l];
  for (int i = 0; i < N; ++i) {
    double bend = 0.;
    if (s == 0.) {
      to->y[i][k] = x->S[MEMORY + i][l];
      continue;
    }
    for (int r = ROWS - 1; r >= 0; --r) bend = x->D[r * N + i][l] + s * bend;
    to->y[i][k] = (1. - s) * x->S[MEMORY + i][l]
                  + s * (x->after[MEMORY + i][l] + (1. - s) * bend);
  }
  if (to->ready == LANES) give(to);
}

static int is_last(const Many *all, const Lanes *x, int l)
{
  const long long k = x->interval[l] + 1;
  return k >= all->intervals || all->breaks[k] >= all->ends[x->member[l]];
}

/* Returns 1 if lane l has a result due up to time t. */
static int has_due(const Many *all, const Lanes *x, int l, double t)
{
  if (x->next[l] >= all->n_times) return 0;
  const double due = times_of(all, x, l)[x->next[l]];
  return due <= t && (is_last(all, x, l) ? due <= x->R[T_END][l] : due < x->R[T_END][l]);
}

static void note_due(const Many *all, Lanes *x, int l)
{
  x->due[l] = x->next[l] < all->n_times ? times_of(all, x, l)[x->next[l]] : INFINITY;
}

/* Updates the algebraic unknowns of lane l to the run data; returns 0 on failure. */
static int follow(Lanes *x, int l)
{
#if FOLLOWS == 2
  double y[N], d[N_D + 1];
  for (int i = 0; i < N; ++i) y[i] = x->S[MEMORY + i][l];
  for (int i = 0; i < N_D; ++i) d[i] = x->R[SIZE_R - N_D + i][l];
  if (symfric_follow(y, d)) return 0;
  for (int i = 0; i < N; ++i) x->S[MEMORY + i][l] = y[i];
#endif
  (void)x, (void)l;
  return FOLLOWS != 1;
}

/* Begins the input interval of lane l; returns 0 on failure. */
static int enter(const Many *all, Lanes *x, int l)
{
  const long long m = x->member[l], k = x->interval[l];
  const double *data = all->data + m * all->data_step;
  x->R[T_END][l] = is_last(all, x, l) ? all->ends[m] : all->breaks[k + 1];
  for (long long i = 0; i < all->n_data; ++i)
    x->R[SIZE_R - all->n_data + i][l] = data[i * all->intervals + k];
  if ((k || all->follow) && !follow(x, l)) return 0;
  while (has_due(all, x, l, x->S[T][l])) ask(all, x, l, 0.);
  note_due(all, x, l);
  return 1;
}

static void finish(const Many *all, Lanes *x, int l, int reason)
{
  const long long m = x->member[l];
  double *out = all->out + m * all->n_times * SIGNALS;
  for (int i = 0; i < S_ROWS; ++i) all->S[m * S_ROWS + i] = x->S[i][l];
  for (int i = 0; i < N; ++i) {
    all->reach[2 * m * N + i] = x->least[i][l];
    all->reach[(2 * m + 1) * N + i] = x->most[i][l];
  }
  for (long long k = x->next[l] * SIGNALS; k < all->n_times * SIGNALS; ++k) out[k] = NAN;
  all->reason[m] = reason;
  all->made[m] = all->max_attempts - x->left[l];
  x->member[l] = -1;
  --x->common->running;
}

/* Gives lane l to the next member, or lets it repeat another lane. */
static void fill(const Many *all, Lanes *x, int l)
{
  int other = 0;
  if (x->common->waiting < all->members) {
    const long long m = x->member[l] = x->common->waiting++;
    for (int i = 0; i < S_ROWS; ++i) x->S[i][l] = all->S[m * S_ROWS + i];
    for (int i = 0; i < SIZE_R; ++i) x->R[i][l] = all->R[m * SIZE_R + i];
    for (int i = 0; i < N; ++i) {
      x->least[i][l] = all->reach[2 * m * N + i];
      x->most[i][l] = all->reach[(2 * m + 1) * N + i];
    }
    x->h_min[l] = all->h_min[m];
    x->left[l] = all->max_attempts - all->made[m];
    x->interval[l] = x->next[l] = 0;
    ++x->common->running;
    if (!enter(all, x, l)) finish(all, x, l, SEARCH);
    return;
  }
  x->member[l] = -1;
  while (other < LANES - 1 && x->member[other] < 0) ++other;
  for (int i = 0; i < S_ROWS; ++i) x->S[i][l] = x->S[i][other];
  for (int i = 0; i < SIZE_R; ++i) x->R[i][l] = x->R[i][other];
  x->h_min[l] = x->h_min[other];
  x->left[l] = x->left[other];
  x->due[l] = INFINITY;
}

static int is_small(const Lanes *x, int l)
{
  return !(x->S[H][l] >= x->h_min[l] && x->S[H][l] >= FLOOR * fabs(x->S[T][l]));
}

/* Gives the stopped lane l its next interval or the next member, until one runs in it. */
static void settle(const Many *all, Lanes *x, int l)
{
  for (;;) {
    if (x->member[l] < 0) {
      const int more = x->common->waiting < all->members;
      fill(all, x, l);
      if (!more) return;
    }
    if (x->member[l] < 0) continue;
    if (!(x->S[T][l] < x->R[T_END][l])) {
      if (is_last(all, x, l)) {
        finish(all, x, l, ENDED);
      } else {
        ++x->interval[l];
        if (!enter(all, x, l)) finish(all, x, l, SEARCH);
      }
    } else if (is_small(x, l)) {
      finish(all, x, l, TOO_SMALL);
    } else if (x->left[l] <= 0) {
      finish(all, x, l, OUT_OF_ATTEMPTS);
    } else {
      return;
    }
  }
}

/* Stores the results of an attempt of the lanes. */
static void take(const Many *all, Lanes *x)
{
  x->left -= 1;
  const I moved = (I)(x->after[T] > x->S[T]);
  for (int i = 0; i < N; ++i) {
    const V y = x->after[MEMORY + i];
    x->least[i] = pick(moved, v_fmin(x->least[i], y), x->least[i]);
    x->most[i] = pick(moved, v_fmax(x->most[i], y), x->most[i]);
  }
  for (unsigned due = which(moved & (I)(x->due <= x->after[T])), l = 0; due; due >>= 1, ++l)
    if (due & 1) {
      const double t0 = x->S[T][l], t1 = x->after[T][l];
      while (has_due(all, x, l, t1))
        ask(all, x, l, (times_of(all, x, l)[x->next[l]] - t0) / (t1 - t0));
      note_due(all, x, l);
    }
  for (int i = 0; i < S_ROWS; ++i) x->S[i] = x->after[i];
  const I goes = (I)(x->S[T] < x->R[T_END]) & (I)(x->S[H] >= x->h_min)
                 & (I)(x->S[H] >= FLOOR * v_fabs(x->S[T])) & (I)(x->left > 0);
  for (unsigned stopped = which(~goes), l = 0; stopped; stopped >>= 1, ++l)
    if (stopped & 1) settle(all, x, l);
}

/* Returns the number of members that run at once. */
int symfric_lanes(void) { return GROUPS * LANES; }

/* Runs all members; returns 0 without enough memory. */
int symfric_many(const Many *all)
{
  const size_t size = sizeof(Common) + GROUPS * (sizeof(Lanes) + (WORK + 1) * sizeof(V));
  char *block = calloc(1, size + sizeof(V));
  if (!block) return 0;
  Common *common = (Common *)(block + (-(size_t)block & (sizeof(V) - 1)));
  Lanes *x = (Lanes *)(common + 1);
  V *work = (V *)(x + GROUPS);
  common->work = work;
  for (int g = 0; g < GROUPS; ++g) {
    x[g].common = common;
    for (int l = 0; l < LANES; ++l) x[g].member[l] = -1;
  }
  for (int l = 0; l < LANES; ++l)
    for (int g = 0; g < GROUPS; ++g) settle(all, x + g, l);
  while (common->running) {
    const V *arg0[2] = {x[0].S, x[0].R};
    V *res0[2] = {x[0].after, x[0].D};
#if GROUPS == 2
    const V *arg1[2] = {x[1].S, x[1].R};
    V *res1[2] = {x[1].after, x[1].D};
    symfric_step(arg0, res0, work, arg1, res1, work + WORK + 1);
#else
    symfric_step(arg0, res0, work);
#endif
    for (int g = 0; g < GROUPS; ++g) take(all, x + g);
  }
  if (common->ready) give(common);
  free(block);
  return 1;
}
