/* Complete loop. FOLLOWS is 0 without algebraic unknowns; 1 if it returns at each jump of inputs,
   for a search in Python; 2 if `symfric_follow` updates them. With SETTLES they are also updated
   after events. With DECIDES `symfric_decide` decides the modes of several contacts. */
#define FOLLOWS $follows
#define SETTLES $settles
#define DECIDES $decides

$decide
/* Run in progress: buffers, limits and counters. */
typedef struct {
  double *S, *R, *rows;
  const double *times;
  double *out;
  const double *breaks, *data;
  double *memory, *jumps, *reach;
  double h_min;
  long long max_rows, max_attempts, max_jumps, n_times, found, intervals, interval, n_data;
  long long count, made, jumped;
} symfric_loop;

/* Writes unknowns at the times within an accepted step, out[unknown][time]; at its end if last. */
static void symfric_outputs(symfric_loop *L, const double *row, int last)
{
  long long i, r;
  for (; L->found < L->n_times; ++L->found) {
    const double time = L->times[L->found];
    double s;
    if (!(time < row[1] || (last && time == row[1]))) return;
    s = (time - row[0]) / (row[1] - row[0]);
    for (i = 0; i < N; ++i) {
      double bend = 0.;
      for (r = DENSE_ROWS - 1; r >= 0; --r) bend = row[2 + 2 * N + r * N + i] + s * bend;
      L->out[i * L->n_times + L->found] =
          (1. - s) * row[2 + i] + s * (row[2 + N + i] + (1. - s) * bend);
    }
  }
}

/* Widens the smallest and largest unknowns, reach[2][N], to the end of an accepted step. */
static void symfric_reach(double *reach, const double *end)
{
  long long i;
  for (i = 0; i < N; ++i) {
    if (end[i] < reach[i]) reach[i] = end[i];
    if (end[i] > reach[N + i]) reach[N + i] = end[i];
  }
}

/* Makes steps over all input intervals, up to a full record, an attempt limit, a tiny step, or a
   request of events. Returns 7 if algebraic unknowns need a full search after a jump of inputs. */
int symfric_march(symfric_loop *L)
{
  L->count = L->made = L->jumped = 0;
  for (;;) {
    double *row = L->rows + L->count * WIDTH;
    long long counts[3], i;
    int stop = symfric_run(L->S, L->R, row, 1, L->max_attempts - L->made, L->h_min, counts,
                           L->memory, L->jumps + L->jumped * JUMP, L->max_jumps - L->jumped);
    L->made += counts[1];
    for (i = 0; i < counts[2]; ++i) L->jumps[(L->jumped + i) * JUMP] += (double)L->count;
    L->jumped += counts[2];
#if SETTLES
    if (stop == 6 && !symfric_follow(L->S + MEM, L->R + GIVEN - $data)) {
      double *after = L->jumps + (L->jumped - 1) * JUMP + 3 + N;
      for (i = 0; i < N; ++i) after[i] = L->S[MEM + i];
      stop = 1;
    }
#endif
#if DECIDES
    if (stop == 8) {
      double *jump = L->jumps + (L->jumped - 1) * JUMP;
      if (!symfric_decide(L->S[T], jump + 3, L->S + MEM, L->R + GIVEN - $data)) {
        for (i = 0; i < N; ++i) jump[3 + N + i] = L->S[MEM + i];
        symfric_note(L->memory);
        stop = 1;
      }
    }
#endif
    if (counts[0]) {
      ++L->count;
      symfric_reach(L->reach, row + 2 + N);
      symfric_outputs(L, row, stop == 0 && L->interval + 1 == L->intervals);
    }
    if (stop >= 3) return stop;
    if (stop == 0) {
      if (L->interval + 1 == L->intervals) return 0;
      ++L->interval;
      L->R[T_END] = L->breaks[L->interval + 1];
      for (i = 0; i < L->n_data; ++i)
        L->R[GIVEN - L->n_data + i] = L->data[i * L->intervals + L->interval];
#if SEARCHES
      if (L->memory[PHASE] == ON) L->memory[PHASE] = JUMPED;
#endif
#if FOLLOWS == 2
      if (symfric_follow(L->S + MEM, L->R + GIVEN - $data)) return 7;
#elif FOLLOWS == 1
      return 7;
#endif
    }
    if (L->count == L->max_rows || (SEARCHES && L->jumped == L->max_jumps)) return 1;
    if (L->made == L->max_attempts) return 2;
  }
}
