/* Makes attempts from S towards R[T_END]; writes a row (t0, t1, y0, y1, D) per accepted step. */
enum { N = $n, MEM = $memory, T = $t, H = $h, T_END = $t_end, GIVEN = $given };
enum { WIDTH = $width, DENSE = $dense, DENSE_ROWS = $dense_rows, JUMP = $jump };
#define SEARCHES $searches

static int symfric_run(double *S, const double *R, double *rows, long long max_rows,
                       long long max_attempts, double h_min, long long *counts,
                       double *memory, double *jumps, long long max_jumps)
{
  double next[MEM + N], w[$w];
  casadi_int iw[$iw];
  const double *arg[$arg];
  double *res[$res];
  long long i, count = 0, made = 0, jumped = 0;
  int stop = 0;
  while (S[T] < R[T_END] && count < max_rows && made < max_attempts
         && S[H] >= h_min && S[H] >= $floor * fabs(S[T])
#if SEARCHES
         && jumped < max_jumps && !stop
#endif
         ) {
    double *row = rows ? rows + count * WIDTH : 0;
    arg[0] = S;
    arg[1] = R;
    res[0] = next;
    res[1] = rows ? row + DENSE : 0;
    symfric_step(arg, res, iw, w, 0);
    ++made;
    if (rows && next[T] > S[T]) {
      row[0] = S[T];
      row[1] = next[T];
      for (i = 0; i < N; ++i) {
        row[2 + i] = S[MEM + i];
        row[2 + N + i] = next[MEM + i];
      }
      ++count;
#if SEARCHES
      const int happened = symfric_search(row, next, R, memory, jumps + jumped * JUMP, count - 1,
                                          iw, w, &stop);
      jumped += happened >= CUT;
      count -= happened == DROPPED;
#endif
    }
    for (i = 0; i < MEM + N; ++i) S[i] = next[i];
  }
  counts[0] = count;
  counts[1] = made;
  counts[2] = jumped;
  if (stop) return stop;
  if (S[T] >= R[T_END]) return 0;
  if (!(S[H] >= h_min && S[H] >= $floor * fabs(S[T]))) return 3;
  return count >= max_rows || (SEARCHES && jumped >= max_jumps) ? 1 : 2;
}
