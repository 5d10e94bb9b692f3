/* Modes of several contacts, decided together as in contact_modes.py, operation by operation. */
enum { CONTACTS = $contacts, TRIALS = 64 };
enum { UP, DOWN, CHANGE_RATE, SLIP, COLUMNS };
static const int symfric_mode_at[] = { $at };
static const int symfric_decided[] = { $decided };
static const double symfric_still[] = { $still };

static void symfric_look(double t, const double *y, const double *d, double *rows)
{
  const double *arg[$arg];
  double *res[$res], w[$w];
  casadi_int iw[$iw];
  arg[0] = &t;
  arg[1] = y;
  arg[2] = d;
  res[0] = rows;
  symfric_contacts(arg, res, iw, w, 0);
}

/* Sets a better mode of the most inconsistent contact; returns 0 if all are consistent. */
static int symfric_objection(double *modes, const int *free, const double *rows)
{
  double largest = 1e-300, worst = 0, better = 0;
  int i, at = -1;
  for (i = 0; i < CONTACTS; ++i) {
    const double change = fabs(rows[i * COLUMNS + CHANGE_RATE]);
    if (change > largest) largest = change;
  }
  for (i = 0; i < CONTACTS; ++i) {
    const double *row = rows + i * COLUMNS, up = row[UP], down = row[DOWN];
    const double least = down < up ? down : up;
    double size, mode;
    if (modes[i] == 0 && least < 0) {
      double level = (up + down) / 2;
      if (!(level > 1e-300)) level = 1e-300;
      size = 2. - least / level;
      mode = up < down ? 1. : -1.;
    } else if (modes[i] != 0 && free[i] && modes[i] * row[CHANGE_RATE] < -$turning * largest) {
      size = -modes[i] * row[CHANGE_RATE] / largest;
      mode = 0.;
    } else {
      continue;
    }
    if (at < 0 || size >= worst) {
      worst = size;
      better = mode;
      at = i;
    }
  }
  if (at >= 0) modes[at] = better;
  return at >= 0;
}

/* Decides the modes in y at time t; returns 1, y unchanged, if Python has to try all combinations.
   `before` contains the unknowns before the events that led to y. */
static int symfric_decide(double t, const double *before, double *y, const double *d)
{
  double rows[CONTACTS * COLUMNS], first[CONTACTS * COLUMNS], now[N];
  double trials[TRIALS][CONTACTS];
  int free[CONTACTS], i, k, seen, same;
  for (i = 0; i < N; ++i) now[i] = y[i];
#if SETTLES
  if (symfric_follow(now, d)) return 1;
#endif
  symfric_look(t, now, d, rows);
  symfric_look(t, before, d, first);
  for (i = 0; i < CONTACTS; ++i) {
    const double slip = rows[i * COLUMNS + SLIP], mode = rint(now[symfric_mode_at[i]]);
    const int kicked = fabs(slip - first[i * COLUMNS + SLIP]) > symfric_still[i];
    free[i] = fabs(slip) <= symfric_still[i] || (mode == 0 && !kicked);
    trials[0][i] = free[i] ? 0. : kicked ? (double)((slip > 0) - (slip < 0)) : mode;
  }
  for (k = 0; k < TRIALS - 1; ++k) {
    double moved[N];
    for (seen = 0; seen < k; ++seen) {
      for (i = 0, same = 1; i < CONTACTS; ++i) same &= trials[seen][i] == trials[k][i];
      if (same) return 1;
    }
    for (i = 0; i < N; ++i) moved[i] = now[i];
    for (i = 0; i < CONTACTS; ++i) {
      moved[symfric_mode_at[i]] = trials[k][i];
      trials[k + 1][i] = trials[k][i];
    }
#if SETTLES
    if (symfric_follow(moved, d)) return 1;
#endif
    symfric_look(t, moved, d, rows);
    if (symfric_objection(trials[k + 1], free, rows)) continue;
    for (i = 0; i < N; ++i) y[i] = moved[i];
    return 0;
  }
  return 1;
}

/* Records in the event memory that no contact has to change its mode (`Eventful.decided`). */
static void symfric_note(double *M)
{
  int i;
  for (i = 0; i < EVENTS; ++i)
    if (symfric_decided[i]) {
      M[BEFORE + i] = (double)NAN;
      M[LAST + i] = 0;
    }
}
