typedef struct { char *at; long long apart; const long long *of; } symfric_place;

/* Evaluates row after row; if chained, the first result is the next first argument. */
void symfric_rows(long long count, int chained, const symfric_place *in, const symfric_place *out)
{
  const double *arg[$arg];
  double *res[$res], w[$w];
  casadi_int iw[$iw];
  long long k;
  int i;
  for (k = 0; k < count; ++k) {
    for (i = 0; i < $arguments; ++i)
      arg[i] = (const double *)(in[i].at + (in[i].of ? in[i].of[k] : k) * in[i].apart);
    if (chained) arg[0] = (const double *)(k ? out[0].at + (k - 1) * out[0].apart : in[0].at);
    for (i = 0; i < $results; ++i) res[i] = (double *)(out[i].at + k * out[i].apart);
    $name(arg, res, iw, w, 0);
  }
}
