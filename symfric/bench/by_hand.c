/* RADAU5 for Rabinowicz's stick-slip with Brown-McPhee friction: one equation of two states, by hand.
   Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8. `contenders.by_hand` defines the
   numbers P_... of the scene in front of it. */
#include <complex.h>
#include <math.h>
/* Eigenvalues gamma and alpha +- i beta of the inverse of A, which T makes block diagonal, TI = T^-1;
   nodes c and weights e of the error estimate. */
#define P_gamma 3.637834252744496
#define P_alpha 2.681082873627754
#define P_beta 3.0504301992474123
#define P_T00 0.09123239487089305
#define P_T01 0.12845806217830086
#define P_T02 0.0273086547513214
#define P_T10 0.2417179327071072
#define P_T11 -0.18563595103095715
#define P_T12 -0.3482489043965752
#define P_T20 0.9660481826150927
#define P_T21 -0.909403517646862
#define P_T22 -0.0
#define P_TI00 4.325579890063157
#define P_TI01 0.3391992518158091
#define P_TI02 0.5417705399358743
#define P_TI10 4.59501036719607
#define P_TI11 0.36032719733585505
#define P_TI12 -0.5241056860367596
#define P_TI20 0.5529697490581569
#define P_TI21 -2.8281471315512685
#define P_TI22 0.6554177471960013
#define P_c1 0.15505102572168222
#define P_c2 0.6449489742783178
#define P_e1 -10.048809399827414
#define P_e2 1.382142733160748
#define P_e3 -0.3333333333333333
static const double m = P_m, k = P_k, N = P_m * P_g, v_belt = P_v_belt, v_t = P_v_t;
static const double mu_s = P_mu_s, mu_d = P_mu_d;
static double acceleration(double x, double v)
{
  const double s = (v - v_belt) / v_t, q = 1. / (0.25 * s * s + 0.75);
  return (-k * x - N * (mu_d * tanh(4. * s) + (mu_s - mu_d) * s * q * q)) / m;
}
static double slope(double v)
{
  const double s = (v - v_belt) / v_t, q = 1. / (0.25 * s * s + 0.75), th = tanh(4. * s);
  return -N * (4. * mu_d * (1. - th * th) + (mu_s - mu_d) * q * q * (1. - s * s * q)) / (v_t * m);
}
/* Steps from (0, v) at 0 to the last of the times; 1 where they shrink to nothing. */
long long by_hand(double v, double rtol, double atol, const double *times, long long count,
                  double *found, long long *steps)
{
  const double c1 = P_c1, c2 = P_c2, newton = fmax(1e-15 / rtol, fmin(0.03, sqrt(rtol)));
  const double end = times[count - 1];
  double t = 0., x = 0., h = 1e-8 * end, a0 = acceleration(x, v), a21 = -k / m, a22 = 0.;
  double z[3][2] = {{0.}}, w[3][2], cont[4][2], h_old = h, h_acc = h, err_acc = 1e-2;
  double g = 0., det = 0., theta = 1., faccon = 1.;
  double complex b = 0., det2 = 0.;
  int fresh = 0, factored = 0, first = 1, reject = 0, i, j, it;
  long long next = 0, made = 0;
  while (next < count) {
    if (!(h > 1e-15 * end)) return 1;
    if (!fresh) { a22 = slope(v); fresh = 1; factored = 0; }
    if (!factored) {
      g = P_gamma / h;
      b = (P_alpha + I * P_beta) / h;
      det = 1. / (g * (g - a22) - a21);
      det2 = 1. / (b * (b - a22) - a21);
      factored = 1;
    }
    if (first) {
      for (i = 0; i < 3; ++i) for (j = 0; j < 2; ++j) z[i][j] = w[i][j] = 0.;
    } else {
      const double c[3] = {c1, c2, 1.};
      for (i = 0; i < 3; ++i) {
        const double s = c[i] * h / h_old;
        for (j = 0; j < 2; ++j)
          z[i][j] = s * (cont[1][j] + (s - c2 + 1.) * (cont[2][j] + (s - c1 + 1.) * cont[3][j]));
      }
      for (j = 0; j < 2; ++j) {
        w[0][j] = P_TI00 * z[0][j] + P_TI01 * z[1][j] + P_TI02 * z[2][j];
        w[1][j] = P_TI10 * z[0][j] + P_TI11 * z[1][j] + P_TI12 * z[2][j];
        w[2][j] = P_TI20 * z[0][j] + P_TI21 * z[1][j] + P_TI22 * z[2][j];
      }
    }
    const double sx = 1. / (atol + rtol * fabs(x)), sv = 1. / (atol + rtol * fabs(v));
    double old = 0., old_rate = 0.;
    int good = 0;
    faccon = pow(fmax(faccon, 1e-16), 0.8);
    for (it = 0; it < 7; ++it) {
      double f[3][2], r[3][2];
      for (i = 0; i < 3; ++i) {
        f[i][0] = v + z[i][1];
        f[i][1] = acceleration(x + z[i][0], v + z[i][1]);
      }
      for (j = 0; j < 2; ++j) {
        r[0][j] = P_TI00 * f[0][j] + P_TI01 * f[1][j] + P_TI02 * f[2][j] - g * w[0][j];
        r[1][j] = P_TI10 * f[0][j] + P_TI11 * f[1][j] + P_TI12 * f[2][j];
        r[2][j] = P_TI20 * f[0][j] + P_TI21 * f[1][j] + P_TI22 * f[2][j];
      }
      const double d0 = ((g - a22) * r[0][0] + r[0][1]) * det;
      const double d1 = (a21 * r[0][0] + g * r[0][1]) * det;
      const double complex p0 = r[1][0] + I * r[2][0] - b * (w[1][0] + I * w[2][0]);
      const double complex p1 = r[1][1] + I * r[2][1] - b * (w[1][1] + I * w[2][1]);
      const double complex q0 = ((b - a22) * p0 + p1) * det2, q1 = (a21 * p0 + b * p1) * det2;
      const double nx = d0 * d0 + creal(q0) * creal(q0) + cimag(q0) * cimag(q0);
      const double nv = d1 * d1 + creal(q1) * creal(q1) + cimag(q1) * cimag(q1);
      const double size = sqrt((nx * sx * sx + nv * sv * sv) / 6.);
      if (!(size < 1e100)) { theta = 2.; break; }
      if (it) {
        const double rate = size / old;
        theta = it == 1 ? rate : sqrt(rate * old_rate);
        old_rate = rate;
        if (!(theta < 0.99)) break;
        faccon = theta / (1. - theta);
        if (faccon * size * pow(theta, 5 - it) > 1e2 * newton) break;
      }
      old = fmax(size, 1e-16);
      w[0][0] += d0; w[1][0] += creal(q0); w[2][0] += cimag(q0);
      w[0][1] += d1; w[1][1] += creal(q1); w[2][1] += cimag(q1);
      for (j = 0; j < 2; ++j) {
        z[0][j] = P_T00 * w[0][j] + P_T01 * w[1][j] + P_T02 * w[2][j];
        z[1][j] = P_T10 * w[0][j] + P_T11 * w[1][j] + P_T12 * w[2][j];
        z[2][j] = P_T20 * w[0][j] + P_T21 * w[1][j] + P_T22 * w[2][j];
      }
      if (faccon * size <= newton) { good = 1; break; }
    }
    ++made;
    if (!good) { h *= 0.5; factored = 0; reject = 1; fresh = fresh == 1; continue; }
    const double ex = (P_e1 * z[0][0] + P_e2 * z[1][0] + P_e3 * z[2][0]) / h;
    const double ev = (P_e1 * z[0][1] + P_e2 * z[1][1] + P_e3 * z[2][1]) / h;
    double rx = ex + v, rv = ev + a0;
    double dx = ((g - a22) * rx + rv) * det, dv = (a21 * rx + g * rv) * det;
    double err = fmax(sqrt((dx * dx * sx * sx + dv * dv * sv * sv) / 2.), 1e-10);
    if (err >= 1. && (first || reject)) {
      rx = ex + v + dv;
      rv = ev + acceleration(x + dx, v + dv);
      dx = ((g - a22) * rx + rv) * det;
      dv = (a21 * rx + g * rv) * det;
      err = fmax(sqrt((dx * dx * sx * sx + dv * dv * sv * sv) / 2.), 1e-10);
    }
    const double fac = fmin(0.9, 0.9 * 15. / (it + 15.)), root = sqrt(sqrt(err));
    double quot = fmax(0.125, fmin(5., root / fac));
    if (err < 1.) {
      if (!first) {
        const double gus = (h_acc / h) * sqrt(sqrt(err * err / err_acc)) / 0.9;
        quot = fmax(quot, fmax(0.125, fmin(5., gus)));
      }
      h_acc = h;
      err_acc = fmax(1e-2, err);
      for (j = 0; j < 2; ++j) {
        const double ak = (z[0][j] - z[1][j]) / (c1 - c2);
        cont[0][j] = (j ? v : x) + z[2][j];
        cont[1][j] = (z[1][j] - z[2][j]) / (c2 - 1.);
        cont[2][j] = (ak - cont[1][j]) / (c1 - 1.);
        cont[3][j] = cont[2][j] - (ak - z[0][j] / c1) / c2;
      }
      t += h;
      for (; next < count && times[next] <= t; ++next) {
        const double s = (times[next] - t) / h;
        for (j = 0; j < 2; ++j)
          found[j * count + next] = cont[0][j] + s * (cont[1][j] + (s - c2 + 1.)
                                    * (cont[2][j] + (s - c1 + 1.) * cont[3][j]));
      }
      x = cont[0][0];
      v = cont[0][1];
      a0 = acceleration(x, v);
      h_old = h;
      ++*steps;
      double h_new = reject ? fmin(h / quot, h) : h / quot;
      first = reject = 0;
      fresh = theta <= 1e-3 && it < 3 ? 2 : 0;
      if (fresh && h_new >= h && h_new <= 1.2 * h) continue;
      h = h_new;
      factored = 0;
    } else {
      reject = 1;
      h = first ? 0.1 * h : h / quot;
      factored = 0;
      if (fresh == 2) fresh = 0;
    }
  }
  return 0;
}
