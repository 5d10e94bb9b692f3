/* Computes the signals of all plants at their current times. */
void symfric_look(const symfric_members *m, double *out)
{
  double w[$w];
  casadi_int iw[$iw];
  const double *arg[$arg];
  double *res[$res];
  long long b;
  for (b = 0; b < m->members; ++b) {
    const double *S = m->S + b * $columns;
    arg[0] = S + $t;
    arg[1] = S + $memory;
    arg[2] = m->R + b * $given + $data;
    res[0] = out + b * $rows;
    $name(arg, res, iw, w, 0);
  }
}
