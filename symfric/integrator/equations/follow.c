
/* Updates algebraic unknowns of y after a jump of d; returns 1, y unchanged, if that fails. */
int symfric_follow(double *y, const double *d)
{
  enum { N = $n };
  double now[N], after[N], look[3], w[$w];
  casadi_int iw[$iw];
  const double *arg[$arg];
  double *res[$res];
  int i, k;
  for (i = 0; i < N; ++i) now[i] = y[i];
  for (k = 0; k < $rounds; ++k) {
    arg[0] = now;
    arg[1] = d;
    res[0] = after;
    res[1] = look;
    $name(arg, res, iw, w, 0);
    if (!(look[1] <= $done || look[1] <= $contraction * look[0])) return 1;
    for (i = 0; i < N; ++i) now[i] = after[i];
    if (look[1] <= $done) {
      if (!(look[2] >= 0)) return 1;
      for (i = 0; i < N; ++i) y[i] = now[i];
      return 0;
    }
  }
  return 1;
}
