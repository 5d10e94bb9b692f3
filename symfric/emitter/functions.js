// Functions of math.h that JavaScript lacks, or whose special cases differ from those of C.

/** The power x^y; 1^y and (-1)^(+-infinity) are 1. */
function pow(x, y) {
  return x === 1 || (x === -1 && Math.abs(y) === Infinity) ? 1 : Math.pow(x, y);
}

/** The remainder of x / y with the sign of x. */
function fmod(x, y) {
  return x % y;
}

/** Return true for negative numbers and -0. */
function negative(x) {
  return x < 0 || Object.is(x, -0);
}

/** The magnitude of x with the sign of y. */
function copysign(x, y) {
  return negative(x) === negative(y) ? x : -x;
}

/** The remainder of x / y to the nearest multiple of y; in a tie the multiple is even. */
function remainder(x, y) {
  const size = Math.abs(y);
  let rest = Math.abs(x) % (size + size);
  if (rest + rest > size) {
    rest -= size;
    if (rest + rest >= size) rest -= size;
  }
  return negative(x) ? -rest : rest;
}

/** The error function, by its series of positive terms; beyond 6 it is 1 to rounding. */
function erf(x) {
  if (Math.abs(x) > 6) return Math.sign(x);
  let term = 2 / Math.sqrt(Math.PI) * Math.exp(-x * x) * x, sum = term;
  for (let n = 1; Math.abs(term) > 1e-17 * Math.abs(sum); n += 1) {
    term *= 2 * x * x / (2 * n + 1);
    sum += term;
  }
  return Number.isNaN(x) ? x : sum;
}
