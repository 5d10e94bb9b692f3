/* Vector arithmetic of members: vectors of LANES numbers, one member per lane.

   Every lane gets the same operations in the same order for any number of lanes, nothing is
   contracted or reordered, and if an argument is outside the range of a formula, libm is called for
   that lane only. The bits of a member therefore depend neither on the number of lanes nor on the
   other members. + - * / and sqrt are IEEE's; the functions are accurate to a few units of the last
   place (tests/.../test_lanes.py).

   Comparisons are masks: all bits of a lane set or none. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#if defined(__clang__) && defined(__SSE2__)
#include <immintrin.h> /* slow to read for gcc, which does not need it */
#endif

#ifndef LANES
#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define LANES 8
#elif defined(__AVX2__)
#define LANES 4
#else
#define LANES 2
#endif
#endif

typedef double V __attribute__((vector_size(8 * LANES)));
typedef long long I __attribute__((vector_size(8 * LANES)));
typedef unsigned long long U __attribute__((vector_size(8 * LANES)));

#define ALL(x) ((x) - (V){})      /* a number in all lanes; the sign of zero stays */
#define LOW 0x000fffffffffffffLL  /* fraction of a double */
#define SIGN_BIT (-0x7fffffffffffffffLL - 1)
#define MAGIC 0x1.8p52            /* adding and subtracting it rounds to an integer */

static inline V pick(I m, V yes, V no) { return (V)((m & (I)yes) | (~m & (I)no)); }
static inline V where(I m, V yes) { return (V)(m & (I)yes); }
static inline V as_number(I m) { return (V)(m & (I)ALL(1.)); }
static inline I as_mask(V x) { return (I)(x != 0.); }

/* Vector instructions that compilers do not generate by themselves. */
#if LANES == 8 && defined(__AVX512DQ__) && defined(__clang__)
#define BITS(m) _mm512_movepi64_mask((__m512i)(m))
#define ROOT(x) _mm512_sqrt_pd((__m512d)(x))
#elif LANES == 4 && defined(__AVX__) && defined(__clang__)
#define BITS(m) _mm256_movemask_pd((__m256d)(m))
#define ROOT(x) _mm256_sqrt_pd((__m256d)(x))
#elif LANES == 2 && defined(__SSE2__) && defined(__clang__)
#define BITS(m) _mm_movemask_pd((__m128d)(m))
#define ROOT(x) _mm_sqrt_pd((__m128d)(x))
#elif LANES == 8 && defined(__AVX512DQ__)
#define BITS(m) __builtin_ia32_cvtq2mask512(m)
#define ROOT(x) __builtin_ia32_sqrtpd512_mask(x, x, -1, 4)
#elif LANES == 4 && defined(__AVX__)
#define BITS(m) __builtin_ia32_movmskpd256((V)(m))
#define ROOT(x) __builtin_ia32_sqrtpd256(x)
#elif LANES == 2 && defined(__SSE2__)
#define BITS(m) __builtin_ia32_movmskpd((V)(m))
#define ROOT(x) __builtin_ia32_sqrtpd(x)
#endif

/* Lanes of a mask as bits of a number. */
static inline unsigned which(I m)
{
#ifdef BITS
  return (unsigned)BITS(m) & ((1u << LANES) - 1);
#else
  unsigned bits = 0;
  for (int l = 0; l < LANES; ++l) bits |= (unsigned)(m[l] & 1) << l;
  return bits;
#endif
}

static inline V v_sqrt(V x)
{
#ifdef ROOT
  return (V)ROOT(x);
#else
  for (int l = 0; l < LANES; ++l) x[l] = sqrt(x[l]);
  return x;
#endif
}

static inline V v_fabs(V x) { return (V)((I)x & ~SIGN_BIT); }
static inline V v_copysign(V x, V s) { return (V)(((I)x & ~SIGN_BIT) | ((I)s & SIGN_BIT)); }
static inline V v_sign(V x) { return pick((I)(x < 0.), ALL(-1.), pick((I)(x > 0.), ALL(1.), x)); }
/* As in C: a NaN is ignored. */
static inline V v_fmin(V x, V y) { return pick((I)(x < y) | (I)(y != y), x, y); }
static inline V v_fmax(V x, V y) { return pick((I)(x > y) | (I)(y != y), x, y); }
/* Clipped from above or below; NaN stays NaN. */
static inline V below(V x, double most) { return pick((I)(x > most), ALL(most), x); }
static inline V above(V x, double least) { return pick((I)(x < least), ALL(least), x); }

static inline V nearest(V x) { return (x + MAGIC) - MAGIC; }
static inline I integer(V whole) { return (I)(whole + MAGIC) - (I)ALL(MAGIC); }
static inline V number(I whole) { return (V)(whole + (I)ALL(MAGIC)) - MAGIC; }
/* 2^k for integer k from -1022 to 1023. */
static inline V power_of_two(V k) { return (V)((I)(k + (MAGIC + 1023.)) << 52); }

/* Functions that call libm lane by lane. */
#define EACH(name) \
  static __attribute__((noinline, unused)) V v_##name(V x) \
  { for (int l = 0; l < LANES; ++l) x[l] = name(x[l]); return x; }
#define EACH_PAIR(name) \
  static __attribute__((noinline, unused)) V v_##name(V x, V y) \
  { for (int l = 0; l < LANES; ++l) x[l] = name(x[l], y[l]); return x; }
/* `found`, replaced by libm in the lanes of `far`. */
#define FAR(name) \
  static __attribute__((noinline, cold)) V far_##name(V x, V found, unsigned far) \
  { for (int l = 0; l < LANES; ++l) if (far >> l & 1) found[l] = name(x[l]); return found; }
#define FAR_PAIR(name) \
  static __attribute__((noinline, cold)) V far_##name(V x, V y, V found, unsigned far) \
  { for (int l = 0; l < LANES; ++l) if (far >> l & 1) found[l] = name(x[l], y[l]); return found; }
FAR(exp) FAR(expm1) FAR(log) FAR(sin) FAR(cos) FAR_PAIR(pow) FAR_PAIR(atan2)
EACH(floor) EACH(ceil) EACH(log1p) EACH(sinh) EACH(cosh) EACH(asinh) EACH(acosh)
EACH(atanh) EACH(erf) EACH_PAIR(fmod) EACH_PAIR(hypot) EACH_PAIR(remainder)

/* e^(r + c) - 1 for |r| <= ln(2)/2 with the rounding error c of r, by its Taylor series. */
static inline V grown(V r, V c)
{
  const V r2 = r * r, r4 = r2 * r2;
  const V a = (1. / 2. + r * (1. / 6.)) + r2 * (1. / 24. + r * (1. / 120.));
  const V b = (1. / 720. + r * (1. / 5040.)) + r2 * (1. / 40320. + r * (1. / 362880.));
  const V d = (1. / 3628800. + r * (1. / 39916800.))
              + r2 * (1. / 479001600. + r * (1. / 6227020800.));
  const V bend = r2 * (a + r4 * (b + r4 * d));
  return r + (bend + (c + c * (r + bend)));
}

/* x = k ln 2 + r + c; returns k. */
static inline V halvings(V x, V *r, V *c)
{
  const V k = nearest(x * 0x1.71547652b82fep+0);
  const V high = x - k * 0x1.62e42fee00000p-1, low = k * 0x1.a39ef35793c76p-33;
  *r = high - low;
  *c = (high - *r) - low;
  return k;
}

/* e^(x + small) from -708 to 709, where it is a normal number. */
static inline V raised(V x, V small)
{
  V r, c;
  const V k = halvings(x, &r, &c);
  return (1. + grown(r, c + small)) * power_of_two(k);
}

static V v_exp(V x)
{
  const V within = above(below(x, 709.), -708.);
  const I none = (I)(x < -746.), beyond = (I)(x > 710.), edge = (I)(within != x) & (I)(x == x);
  const V found = pick(beyond, ALL(INFINITY), where(~none, raised(within, (V){})));
  const unsigned far = which(edge & ~none & ~beyond);
  return far ? far_exp(x, found, far) : found;
}

static V v_expm1(V x)
{
  V r, c;
  const V within = above(below(x, 709.), -50.), k = halvings(within, &r, &c);
  const V scale = power_of_two(k);
  const V found = v_copysign(scale * grown(r, c) + (scale - 1.), x);
  const unsigned far = which((I)(x > 709.));
  return far ? far_expm1(x, found, far) : found;
}

/* (e^2x - 1) / (e^2x + 1) */
static V v_tanh(V x)
{
  V r, c;
  const V k = halvings(2. * below(v_fabs(x), 20.), &r, &c), scale = power_of_two(k);
  const V t = scale * grown(r, c) + (scale - 1.);
  return v_copysign(t / (t + 2.), x);
}

/* x = m 2^e with m from sqrt(1/2) to sqrt(2), for normal positive x. */
static inline V mantissa(V x, V *e)
{
  const I bits = (I)x;
  const V m = (V)((bits & LOW) | (I)ALL(1.));
  const I large = (I)(m > 0x1.6a09e667f3bcdp+0);
  *e = number((I)((U)bits >> 52) - 1023 - large);
  return pick(large, 0.5 * m, m);
}

/* (atanh(s) / s - 1) / z in z = s^2 */
static inline V atanh_series(V z)
{
  const V z2 = z * z, z4 = z2 * z2;
  const V a = (1. / 3. + z * (1. / 5.)) + z2 * (1. / 7. + z * (1. / 9.));
  const V b = (1. / 11. + z * (1. / 13.)) + z2 * (1. / 15. + z * (1. / 17.));
  return a + z4 * (b + z4 * ((1. / 19. + z * (1. / 21.)) + z2 * (1. / 23.)));
}

static inline unsigned not_normal(V x) { return which(~((I)(x >= 0x1p-1022) & (I)(x < INFINITY))); }

/* log(1 + f) = f - f^2/2 + s (f^2/2 + 2 s^2 (...)), s = f / (2 + f) */
static V v_log(V x)
{
  V e;
  const V f = mantissa(x, &e) - 1., s = f / (2. + f), half = 0.5 * f * f;
  const V rest = s * (half + 2. * (s * s) * atanh_series(s * s));
  const V found = e * 0x1.62e42fee00000p-1 - ((half - (rest + e * 0x1.a39ef35793c76p-33)) - f);
  const unsigned far = not_normal(x);
  return far ? far_log(x, found, far) : found;
}

/* a b = product + error, exactly (Dekker, without a fused multiply-add, which not all have). */
static inline V product(V a, V b, V *error)
{
  const V p = a * b, ca = 134217729. * a, cb = 134217729. * b;
  const V ah = ca - (ca - a), bh = cb - (cb - b), al = a - ah, bl = b - bh;
  *error = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
  return p;
}

/* x^y by the logarithm in double-double precision. */
static V v_pow(V x, V y)
{
  V e, error, low;
  const V m = mantissa(x, &e), f = m - 1., d = m + 1., missing = m - (d - 1.);
  const V s = f / d, p = product(s, d, &error);
  const V tail = (((f - p) - error) - s * missing) / d, z = s * s;
  /* log x = e ln 2 + 2 s + (2 tail + 2 s^3 (...)) */
  const V whole = e * 0x1.62e42fee00000p-1, sum = whole + 2. * s;
  const V back = sum - whole, lost = (whole - (sum - back)) + (2. * s - back);
  const V fine = 2. * (tail + s * z * atanh_series(z)) + e * 0x1.a39ef35793c76p-33 + lost;
  const V high = sum + fine, rest = (sum - high) + fine;
  const V t = product(y, high, &low), within = above(below(t, 709.), -708.);
  const V found = raised(within, low + y * rest);
  const I sound = (I)(within == t) & (I)(v_fabs(y) < 0x1p60);
  const unsigned far = not_normal(x) | which(~sound);
  return far ? far_pow(x, y, found, far) : found;
}

/* a - b = difference + error, exactly. */
static inline V difference(V a, V b, V *error)
{
  const V d = a - b, back = d - a;
  *error = (a - (d - back)) - (b + back);
  return d;
}

/* x = k pi/2 + r + c (Cody and Waite, four parts of pi/2); returns k. */
static inline I quarters(V x, V *r, V *c)
{
  V e1, e2;
  const V k = nearest(x * 0x1.45f306dc9c883p-1);
  const V first = difference(x - k * 0x1.921fb54400000p+0, k * 0x1.0b4611a600000p-34, &e1);
  const V second = difference(first, k * 0x1.3198a2e000000p-69, &e2);
  const V small = (e1 + e2) - k * 0x1.b839a252049c1p-104;
  *r = second + small;
  *c = (second - *r) + small;
  return integer(k);
}

/* sin(r + c) and cos(r + c) for |r| <= pi/4, by Taylor's series. */
static inline V sine(V r, V c)
{
  const V z = r * r, z2 = z * z;
  const V a = (-1. / 6. + z * (1. / 120.)) + z2 * (-1. / 5040. + z * (1. / 362880.));
  const V b = (-1. / 39916800. + z * (1. / 6227020800.))
              + z2 * (-1. / 1307674368000. + z * (1. / 355687428096000.));
  return r + (z * r * (a + z2 * z2 * b) + c * (1. - 0.5 * z));
}

static inline V cosine(V r, V c)
{
  const V z = r * r, z2 = z * z, half = 0.5 * z, w = 1. - half;
  const V a = (1. / 24. + z * (-1. / 720.)) + z2 * (1. / 40320. + z * (-1. / 3628800.));
  const V b = (1. / 479001600. + z * (-1. / 87178291200.)) + z2 * (1. / 20922789888000.);
  return w + (((1. - w) - half) + (z2 * (a + z2 * z2 * b) - r * c));
}

static V v_sincos(V x, V *other)
{
  V r, c;
  const I k = quarters(x, &r, &c), odd = -(k & 1);
  const V s = sine(r, c), co = cosine(r, c);
  const V of_sine = (V)((I)pick(odd, co, s) ^ ((k & 2) << 62));
  const V of_cosine = (V)((I)pick(odd, s, co) ^ (((k + 1) & 2) << 62));
  const unsigned far = which((I)(v_fabs(x) > 1e6));
  *other = far ? far_cos(x, of_cosine, far) : of_cosine;
  return pick((I)(v_fabs(x) < 0x1p-27), x, far ? far_sin(x, of_sine, far) : of_sine);
}

static inline V v_sin(V x) { V other; return v_sincos(x, &other); }
static inline V v_cos(V x) { V other; v_sincos(x, &other); return other; }
static inline V v_tan(V x) { V other; const V s = v_sincos(x, &other); return s / other; }

/* atan(n / d) for 0 <= n, 0 < d, by Taylor's series about the ratios 0, 13/32, 1, 32/13, oo. */
static inline V arc(V n, V d)
{
  const I over = (I)(n > d);
  const V small = pick(over, d, n), large = pick(over, n, d);
  const I middle = (I)(small > 0.2 * large), upper = (I)(small > (2. / 3.) * large);
  const V c = pick(upper, ALL(1.), where(middle, ALL(13. / 32.)));
  const V t = (small - c * large) / (large + c * small), z = t * t, z2 = z * z, z4 = z2 * z2;
  const V a = (-1. / 3. + z * (1. / 5.)) + z2 * (-1. / 7. + z * (1. / 9.));
  const V b = (-1. / 11. + z * (1. / 13.)) + z2 * (-1. / 15. + z * (1. / 17.));
  const V series = z * t * (a + z4 * (b + z4 * ((-1. / 19. + z * (1. / 21.)) + z2 * (-1. / 23.))));
  const V far = pick(middle, ALL(0x1.2f56805f1a64fp+0), ALL(0x1.921fb54442d18p+0));
  const V far_low = pick(middle, ALL(-0x1.4d472d7231f8dp-56), ALL(0x1.1a62633145c07p-54));
  const V near = pick(over, far, where(middle, ALL(0x1.8b24d394a1b25p-2)));
  const V near_low = pick(over, far_low, where(middle, ALL(0x1.b6d0ba3748fa8p-56)));
  const V base = pick(upper, ALL(0x1.921fb54442d18p-1), near);
  const V base_low = pick(upper, ALL(0x1.1a62633145c07p-55), near_low);
  const V angle = (V)((I)t ^ (over & SIGN_BIT)), bend = (V)((I)series ^ (over & SIGN_BIT));
  return base + (angle + (bend + base_low));
}

static V v_atan(V x)
{
  const V size = v_fabs(x), found = arc(below(size, 1e300), ALL(1.));
  return pick((I)(size < 0x1p-27), x, v_copysign(found, x));
}

static V v_atan2(V y, V x)
{
  const V a = v_fabs(y), b = v_fabs(x), first = arc(a, b);
  const V turned = 0x1.921fb54442d18p+1 - (first - 0x1.1a62633145c07p-53);
  const V found = v_copysign(pick((I)((I)x < 0), turned, first), y);
  const V least = v_fmin(a, b), most = v_fmax(a, b);
  const I sound = ((I)(least > 0x1p-500) | (I)(least == 0.)) & (I)(most > 0x1p-500);
  const unsigned far = which(~(sound & (I)(most < 0x1p500)));
  return far ? far_atan2(y, x, found, far) : found;
}

static inline V v_asin(V x) { return v_atan2(x, v_sqrt((1. - x) * (1. + x))); }
static inline V v_acos(V x) { return 2. * v_atan2(v_sqrt(1. - x), v_sqrt(1. + x)); }
