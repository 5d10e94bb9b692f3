/* Zero crossings in an accepted step; M is the event memory between steps. */
enum { EVENTS = $events, LOOKS = $looks, RESETS = $resets, UNKNOWNS = $n, KEPT = $kept };
enum { PHASE, TOLERANCE, COUNT, ALIKE, RESUME, TIMES };
enum { BEFORE = TIMES + KEPT, LAST = BEFORE + EVENTS };
enum { FRESH, JUMPED, ON };
enum { HITS = 1, DOUBTS = 2 };
enum { NOTHING, RESUMED, CUT, DROPPED };
static const double symfric_look_at[] = { $at_looks };
static const int symfric_directions[] = { $directions };
static const int symfric_terminal[] = { $terminal };
static const int symfric_changes[] = { $changes };
static const int symfric_by_event[] = { $by_event };
static const int symfric_of_state[] = { $of_state };

typedef struct { const double *row, *d; casadi_int *iw; double *w; } symfric_place;

static void symfric_within(const symfric_place *p, double theta, double *g)
{
  const double *arg[$arg];
  double *res[$res];
  arg[0] = &theta;
  arg[1] = p->row;
  arg[2] = p->d;
  res[0] = g;
  symfric_values(arg, res, p->iw, p->w, 0);
}

static int symfric_passed(double before, double after, int direction)
{
  return (before < 0 && after >= 0 && direction >= 0)
      || (before > 0 && after <= 0 && direction <= 0);
}

/* Returns the root of one event in [a, b] by the Illinois method, rounded up. */
static double symfric_locate(const symfric_place *p, int event, double a, double b,
                             double fa, double fb, double tolerance)
{
  double g[EVENTS], c, fc, low, high;
  int k, side = 0;
  if (fb == 0) return b;
  for (k = 0; k < 100 && b - a > tolerance; ++k) {
    c = (fa * b - fb * a) / (fa - fb);
    low = a + 1e-3 * (b - a);
    high = b - 1e-3 * (b - a);
    if (side && low > c) c = low;
    if (side && high < c) c = high;
    symfric_within(p, c, g);
    fc = g[event];
    if (fc == 0) return c;
    if ((fc > 0) == (fb > 0)) {
      b = c;
      fb = fc;
      if (side == 1) fa = fa / 2;
      side = 1;
    } else {
      a = c;
      fa = fc;
      if (side == -1) fb = fb / 2;
      side = -1;
    }
  }
  return b;
}

/* First roots found in a step (above 1 if there is none), the noise of the events once it is known,
   the event tolerance as a fraction of the step, and the number of subdivisions still allowed. */
typedef struct { double root[EVENTS], noise[EVENTS], tolerance; int known, left; } symfric_found;

/* Returns HITS and DOUBTS of one event between five places; marks doubtful pieces if `wanted`. */
static int symfric_examined(const symfric_place *p, symfric_found *f, const double *g, int event,
                            int wanted, int (*suspects)[EVENTS])
{
  const double *arg[$arg];
  double *res[$res], five[LOOKS + 1], doubts[LOOKS], none = 0;
  int k, found = 0;
  for (k = 0; k <= LOOKS; ++k) five[k] = g[k * EVENTS + event];
  for (k = 0; k < LOOKS; ++k)
    if (symfric_passed(five[k], five[k + 1], symfric_directions[event])) found |= HITS;
  while (wanted) {
    arg[0] = five;
    arg[1] = f->known ? f->noise + event : &none;
    res[0] = doubts;
    symfric_doubt(arg, res, p->iw, p->w, 0);
    for (k = 0, wanted = 0; k < LOOKS; ++k) wanted |= doubts[k] != 0;
    if (!wanted || f->known) break;
    arg[0] = p->row;
    arg[1] = p->d;
    res[0] = f->noise;
    symfric_noise(arg, res, p->iw, p->w, 0);
    f->known = 1;
  }
  for (k = 0; k < LOOKS && wanted; ++k) suspects[k][event] = doubts[k] != 0;
  return wanted ? found | DOUBTS : found;
}

/* Does the same for all events. If all bends are small relative to the values (STRAIGHT), there
   is no doubt and at most one root. If `wanted` is 0, all events are wanted. */
static int symfric_scanned(const symfric_place *p, symfric_found *f, const double *g,
                           const int *wanted, int (*suspects)[EVENTS])
{
  int busy[EVENTS], i, k, found = 0;
  for (i = 0; i < EVENTS; ++i) {
    const double v0 = g[i], v1 = g[EVENTS + i], v2 = g[2 * EVENTS + i], v3 = g[3 * EVENTS + i];
    const double v4 = g[4 * EVENTS + i];
    double least = fabs(v0);
    least = fabs(v1) < least ? fabs(v1) : least;
    least = fabs(v2) < least ? fabs(v2) : least;
    least = fabs(v3) < least ? fabs(v3) : least;
    least = fabs(v4) < least ? fabs(v4) : least;
    busy[i] = !(least >= $straight * (fabs(v0 - 2 * v1 + v2) + fabs(v1 - 2 * v2 + v3)
                                 + fabs(v2 - 2 * v3 + v4)))
              || symfric_passed(v0, v4, symfric_directions[i]);
    found |= busy[i];
  }
  if (!found) return 0;
  for (i = found = 0; i < EVENTS; ++i) {
    for (k = 0; k < LOOKS; ++k) suspects[k][i] = 0;
    if (busy[i]) found |= symfric_examined(p, f, g, i, !wanted || wanted[i], suspects);
  }
  return found;
}

static double symfric_first(const symfric_place *p, symfric_found *f, const double *at,
                            const double *g, int found, int (*suspects)[EVENTS]);

/* Repeats symfric_first from a to b for the wanted events; g holds the values at a. */
static double symfric_again(const symfric_place *p, symfric_found *f, double a, double b, double *g,
                            const int *wanted)
{
  double at[LOOKS + 1];
  int suspects[LOOKS][EVENTS], k;
  --f->left;
  if (b < a) b = a;
  for (k = 0; k <= LOOKS; ++k) at[k] = a + symfric_look_at[k] * (b - a);
  for (k = 1; k <= LOOKS; ++k) symfric_within(p, at[k], g + k * EVENTS);
  return symfric_first(p, f, at, g, symfric_scanned(p, f, g, wanted, suspects), suspects);
}

/* Returns the first root between the places `at` with values g, or a value beyond them. If there is
   a certain root, doubtful events are searched once more before it, because those that jump with its
   event do not jump earlier. Otherwise, or if the root is their own, they are searched piece by
   piece. */
static double symfric_first(const symfric_place *p, symfric_found *f, const double *at,
                            const double *g, int found, int (*suspects)[EVENTS])
{
  double again[(LOOKS + 1) * EVENTS], sure = 2, share = $sharper * f->tolerance, root;
  double width = f->tolerance < 1e-15 ? 1e-15 : f->tolerance;
  int others[EVENTS], i, k, some = 0;
  if (share < 1e-15) share = 1e-15;
  for (i = 0; i < EVENTS; ++i)
    if (f->root[i] < sure) sure = f->root[i];
  for (k = 0; k < LOOKS && found; ++k) {
    const double *g0 = g + k * EVENTS, *g1 = g0 + EVENTS, before = sure;
    const int more = at[k + 1] - at[k] > width && f->left > 0;
    for (i = 0; i < EVENTS; ++i) {
      suspects[k][i] &= more;
      if (suspects[k][i] || at[k] >= before || f->root[i] <= at[0]) continue;
      if (symfric_passed(g0[i], g1[i], symfric_directions[i]))
        f->root[i] = symfric_locate(p, i, at[k], at[k + 1], g0[i], g1[i], share);
      if (f->root[i] < sure) sure = f->root[i];
    }
  }
  if (!(found & DOUBTS)) return sure;
  for (i = 0; i < EVENTS; ++i) {
    others[i] = 0;
    again[i] = g[i];
    for (k = 0; k < LOOKS && sure <= at[LOOKS] && f->root[i] > 1; ++k) {
      if (at[k] < sure && suspects[k][i]) others[i] = some = 1;
      if (at[k] < sure) suspects[k][i] = 0;
    }
  }
  if (some) sure = symfric_again(p, f, at[0], sure - share, again, others);
  for (k = 0; k < LOOKS && at[k] < sure; ++k) {
    some = 0;
    for (i = 0; i < EVENTS; ++i) {
      again[i] = g[k * EVENTS + i];
      some += suspects[k][i];
    }
    if (!some) continue;
    root = symfric_again(p, f, at[k], at[k + 1], again, suspects[k]);
    if (root <= at[k + 1]) return root;
  }
  for (i = 0; i < EVENTS; ++i)
    if (f->root[i] < sure) sure = f->root[i];
  return sure;
}

/* Returns the place of the first events in the step, -1 without events; marks them in `which`. */
static double symfric_crossing(const symfric_place *p, double *M, double *which)
{
  const double *arg[$arg];
  double *res[$res];
  double g[(LOOKS + 1) * EVENTS], at[LOOKS + 1], low = 0, first = 2;
  double h = p->row[1] - p->row[0];
  symfric_found f;
  int suspects[LOOKS][EVENTS], i, found, jumped = 0;
  f.known = 0;
  f.left = $finer;
  f.tolerance = M[TOLERANCE] / h;
  for (i = 0; i < EVENTS; ++i) f.root[i] = 2;
  if (M[PHASE] == ON) {
    for (i = 0; i < EVENTS; ++i) g[i] = M[BEFORE + i];
  } else if (M[PHASE] == FRESH) {
    symfric_within(p, 0, g);
  } else {
    low = $soon * M[TOLERANCE] / h;
    if (low > 0.1) low = 0.1;
    symfric_within(p, low, g);
    for (i = 0; i < EVENTS; ++i)
      if (symfric_passed(M[BEFORE + i], g[i], symfric_directions[i]) && g[i] != 0) {
        f.root[i] = 0;
        jumped = 1;
      }
  }
  arg[0] = &low;
  arg[1] = p->row;
  arg[2] = p->d;
  res[0] = g + EVENTS;
  symfric_looks(arg, res, p->iw, p->w, 0);
  found = symfric_scanned(p, &f, g, 0, suspects);
  if (found || jumped) {
    for (i = 0; i <= LOOKS; ++i) at[i] = low + symfric_look_at[i] * (1 - low);
    first = symfric_first(p, &f, at, g, found, suspects);
  }
  if (first <= 1) {
    for (i = 0; i < EVENTS; ++i)
      which[i] = f.root[i] <= 1 && (f.root[i] - first) * h <= M[TOLERANCE];
    return first;
  }
  for (i = 0; i < EVENTS; ++i) M[BEFORE + i] = g[LOOKS * EVENTS + i];
  M[PHASE] = ON;
  return -1;
}

/* Returns 1 if the events at time t change several modes (see `piled` in events.py). */
static int symfric_piled(const double *M, double t, const double *which)
{
  int i, own = 0, last = 0;
  double apart = nextafter(fabs(t), HUGE_VAL) - fabs(t);
  for (i = 0; i < EVENTS; ++i) {
    if (which[i] != 0) own += symfric_changes[i];
    last += symfric_changes[i] == 1 && M[LAST + i] != 0;
  }
  if (own != 1 || !last) return own > 1;
  if (apart < M[TOLERANCE]) apart = M[TOLERANCE];
  return t - M[TIMES + ((long long)M[COUNT] - 1) % KEPT] < 10 * apart;
}

/* Returns 1 if the events at time t complete a storm (see `storm` in events.py). */
static int symfric_storm(double *M, double t, const double *which)
{
  int i, alike = 1;
  long long count = (long long)M[COUNT];
  double apart, a, b, c;
  for (i = 0; i < EVENTS; ++i)
    if (M[LAST + i] != which[i]) alike = 0;
  for (i = 0; i < EVENTS; ++i) M[LAST + i] = which[i];
  M[TIMES + count % KEPT] = t;
  M[COUNT] = (double)++count;
  M[ALIKE] = alike ? M[ALIKE] + 1 : 1;
  apart = nextafter(fabs(t), HUGE_VAL) - fabs(t);
  if (apart < M[TOLERANCE]) apart = M[TOLERANCE];
  if (count >= KEPT && t - M[TIMES + count % KEPT] < 10 * apart * KEPT) return 1;
  if (M[ALIKE] < $alike) return 0;
  a = M[TIMES + (count - 3) % KEPT] - M[TIMES + (count - 4) % KEPT];
  b = M[TIMES + (count - 2) % KEPT] - M[TIMES + (count - 3) % KEPT];
  c = t - M[TIMES + (count - 2) % KEPT];
  return b < a && c < b && c * c / (b - c) < 1000 * M[TOLERANCE];
}

/* Searches the accepted step `row`, which led to S, for events. The first ones are carried out: the
   row is cut there, S continues after them, and `jump` records them. If they happen at the very
   start, the row is dropped. Without events the step in S may be lengthened if a previous event
   shortened it. */
static int symfric_search(double *row, double *S, const double *R, double *M, double *jump,
                          long long rows, casadi_int *iw, double *w, int *stop)
{
  const double *d = R + $d;
  symfric_place p = { row, d, iw, w };
  const double *arg[$arg];
  double *res[$res], *which = jump + 3 + 2 * UNKNOWNS, *after = jump + 3 + UNKNOWNS;
  double cut[$row], fresh[RESETS + 1], theta = symfric_crossing(&p, M, which);
  double h = row[1] - row[0], least;
  int i, over = 0, kept, several;
  if (theta < 0) {
    h = R[$h_max] < M[RESUME] ? R[$h_max] : M[RESUME];
    M[RESUME] = 0;
    if (S[1] >= h) return NOTHING;
    S[1] = h;
    return RESUMED;
  }
  if (M[RESUME] < h) M[RESUME] = h;
  arg[0] = &theta;
  arg[1] = row;
  res[0] = cut;
  symfric_cut(arg, res, iw, w, 0);
  kept = cut[1] != row[0];
  if (kept)
    for (i = 0; i < $row; ++i) row[i] = cut[i];
  arg[0] = cut;
  arg[1] = d;
  res[0] = M + BEFORE;
  res[1] = fresh;
  symfric_jump(arg, res, iw, w, 0);
  M[PHASE] = JUMPED;
  for (i = 0; i < EVENTS; ++i)
    if (which[i] != 0) M[BEFORE + i] = (double)NAN;
  jump[0] = (double)(kept ? rows + 1 : rows);
  jump[1] = cut[1];
  jump[2] = theta > 0 ? (kept ? h : -h) : 0;
  for (i = 0; i < UNKNOWNS; ++i) jump[3 + i] = after[i] = cut[$y1 + i];
  for (i = 0; i < RESETS; ++i)
    if (which[symfric_by_event[i]] != 0) after[symfric_of_state[i]] = fresh[i];
  least = $least * h;
  if ($restart * M[TOLERANCE] < h) h = $restart * M[TOLERANCE];
  if (h < least) h = least;
  if (h < $sure * fabs(cut[1])) h = $sure * fabs(cut[1]);
  S[0] = cut[1];
  S[1] = h;
  S[2] = h;
  S[3] = $growth;
  S[4] = 0;
  for (i = 0; i < UNKNOWNS; ++i) S[$memory + i] = after[i];
  for (i = 0; i < EVENTS; ++i)
    if (which[i] != 0 && symfric_terminal[i]) over = 1;
  several = symfric_piled(M, cut[1], which);
  if (over)
    *stop = 4;
  else if (symfric_storm(M, cut[1], which))
    *stop = 5;
  else if (several)
    *stop = 8;
  else if ($follows)
    *stop = 6;
  return kept ? CUT : DROPPED;
}
