/* Functions whose arguments are the same in all lanes: libm is called once. */
#define v_exp(x) ALL(exp((x)[0]))
#define v_expm1(x) ALL(expm1((x)[0]))
#define v_log(x) ALL(log((x)[0]))
#define v_log1p(x) ALL(log1p((x)[0]))
#define v_tan(x) ALL(tan((x)[0]))
#define v_asin(x) ALL(asin((x)[0]))
#define v_acos(x) ALL(acos((x)[0]))
#define v_atan(x) ALL(atan((x)[0]))
#define v_sinh(x) ALL(sinh((x)[0]))
#define v_cosh(x) ALL(cosh((x)[0]))
#define v_tanh(x) ALL(tanh((x)[0]))
#define v_asinh(x) ALL(asinh((x)[0]))
#define v_acosh(x) ALL(acosh((x)[0]))
#define v_atanh(x) ALL(atanh((x)[0]))
#define v_erf(x) ALL(erf((x)[0]))
#define v_pow(x, y) ALL(pow((x)[0], (y)[0]))
#define v_atan2(x, y) ALL(atan2((x)[0], (y)[0]))
#define v_hypot(x, y) ALL(hypot((x)[0], (y)[0]))
#define v_fmod(x, y) ALL(fmod((x)[0], (y)[0]))
#define v_remainder(x, y) ALL(remainder((x)[0], (y)[0]))
#define v_sincos symfric_sincos
static inline V symfric_sincos(V x, V *other)
{
  *other = ALL(cos(x[0]));
  return ALL(sin(x[0]));
}

$functions
enum { NAMES = $names, N = $n, X_SIZE = $x, COLUMN = $column };
typedef struct { char *at; long long apart; const long long *of; } symfric_place;
static const double symfric_seeds[] = { $seeds };

static const double *symfric_at(const symfric_place *p, long long k)
{
  return (const double *)(p->at + (p->of ? p->of[k] : k) * p->apart);
}

static void symfric_same(V *a, const symfric_place *p, long long k, int size)
{
  const double *x = symfric_at(p, k);
  int i;
  for (i = 0; i < size; ++i) a[i] = ALL(x[i]);
}

/* Loads the columns of the names from b on, one per lane. */
static void symfric_lanes(V *a, const double *x, int size, int b)
{
  int i, j;
  for (i = 0; i < size; ++i)
    for (j = 0; j < LANES; ++j) a[i][j] = b + j < NAMES ? x[(b + j) * size + i] : 0;
}

void $loop(long long count, int chained, const symfric_place *in, const symfric_place *out)
{
  V $symbols, next[X_SIZE], column[COLUMN], w[$slots];
  const V *arg[] = { $arguments };
  V *res[] = { next, column };
  const double *X = (const double *)in[0].at;
  long long k;
  int i, j, b;
  for (k = 0; k < count; ++k) {
    double *to = (double *)(out[0].at + k * out[0].apart);
    double *parts = (double *)(out[1].at + k * out[1].apart);
$common
    for (b = 0; b < NAMES; b += LANES) {
$own
      for (i = 0; i < $data; ++i)
        for (j = 0; j < LANES; ++j) a4[i][j] = symfric_seeds[(b + j) * $width + i];
      symfric_one(arg, res, w);
      for (j = 0; j < LANES && b + j < NAMES; ++j) {
        for (i = 0; i < X_SIZE; ++i) to[(b + j) * X_SIZE + i] = next[i][j];
        for (i = 0; i < COLUMN; ++i)
          parts[(i / N * NAMES + b + j) * N + i % N] = column[i][j];
      }
    }
    X = to;
  }
}
