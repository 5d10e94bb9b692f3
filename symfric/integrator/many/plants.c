/* Sets new inputs and the next sample time; returns 0 if algebraic unknowns could not follow. */
static int symfric_takes_over(const symfric_members *m, long long b)
{
  double *S = m->S + b * S_ROWS, *R = m->R + b * SIZE_R;
  m->count[b] += S[T] >= R[T_END];
  m->made[b] = 0;
  R[T_END] = m->begin[b] + m->count[b] * m->dt;
  for (int i = 0; i < HELD; ++i) R[SIZE_R - HELD + i] = m->u[b * HELD + i];
#if FOLLOWS == 2
  return m->ready[b] || !symfric_follow(S + MEMORY, R + SIZE_R - N_D);
#else
  return 1;
#endif
}

/* Advances all plants to their next sample; returns how many did not get there. */
long long symfric_plants(const symfric_members *m, int begin)
{
  const long long members = m->members;
  long long b, failed = 0;
  if (begin)
    for (b = 0; b < members * HELD; ++b)
      if (!(m->u[b] - m->u[b] == 0)) return REFUSED;
  double *room = calloc(members, (3 + 2 * N) * sizeof(double));
  if (!room) return -2;
  double *ends = room, *h_min = room + members, *reach = room + 3 * members;
  long long *reason = (long long *)(room + 2 * members);
  for (b = 0; b < members; ++b) {
    const double *now = m->S + b * S_ROWS + T;
    if (begin) m->why[b] = symfric_takes_over(m, b) ? AGAIN : SEARCHED;
    ends[b] = m->why[b] == AGAIN ? m->R[b * SIZE_R + T_END] : *now; /* others do not move */
    h_min[b] = m->h_min;
  }
  const Many all = {
    .S = m->S, .R = m->R, .members = members, .intervals = 1, .ends = ends, .h_min = h_min,
    .max_attempts = m->attempts, .reason = reason, .made = m->made, .reach = reach,
  };
  const int ran = symfric_many(&all);
  for (b = 0; b < members; ++b) {
    if (m->why[b] == AGAIN) {
      m->why[b] = reason[b];
      m->ready[b] = 0;
    }
    failed += m->why[b] != 0;
  }
  free(room);
  return ran ? failed : -2;
}
