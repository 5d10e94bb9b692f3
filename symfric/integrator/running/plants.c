/* Advances plants from sample to sample by the attempts of `attempts.c`, without records. */
enum { NU = $nu, DATA = $data, HELD = $held };
#if !$follows
static int symfric_follow(double *y, const double *d) { return 0; }
#endif

/* Makes attempts towards R[T_END]; returns the reason to stop. */
static int symfric_runs(const symfric_members *m, double *S, const double *R, long long *made)
{
  long long counts[3];
  const int why = symfric_run(S, R, 0, 1, m->attempts, m->h_min, counts, 0, 0, 0);
  *made += counts[1];
  return why;
}

/* Sets new inputs and the next sample time; returns 0 if algebraic unknowns could not follow. */
static int symfric_takes_over(const symfric_members *m, long long b)
{
  double *R = m->R + b * GIVEN;
  int i;
  m->count[b] += m->S[b * (MEM + N) + T] >= R[T_END];
  m->made[b] = 0;
  R[T_END] = m->begin[b] + m->count[b] * m->dt;
  for (i = 0; i < NU; ++i) R[HELD + i] = m->u[b * NU + i];
  return m->ready[b] || !symfric_follow(m->S + b * (MEM + N) + MEM, R + DATA);
}

/* Advances all plants to their next sample; returns how many did not get there. */
long long symfric_plants(const symfric_members *m, int begin)
{
  long long b, failed = 0;
  if (begin)
    for (b = 0; b < m->members * NU; ++b)
      if (!(m->u[b] - m->u[b] == 0)) return $refused;
  for (b = 0; b < m->members; ++b) {
    if (begin && !symfric_takes_over(m, b)) {
      m->why[b] = $search;
    } else if (begin || m->why[b] == $again) {
      m->ready[b] = 0;
      m->why[b] = symfric_runs(m, m->S + b * (MEM + N), m->R + b * GIVEN, m->made + b);
    }
    failed += m->why[b] != 0;
  }
  return failed;
}
