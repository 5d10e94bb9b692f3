/* Bits of a number. Comparing bits is as fast, and detects NaN under -ffast-math too. */
static @whole @{name}_bits(@real x)
{
    @whole found;
    (void)memcpy(&found, &x, sizeof found);
    return found;
}

/* Returns true if |x| is above limit, infinite or NaN. */
static bool @{name}_beyond(@real x, @real limit)
{
    return (@{name}_bits(x) & @magnitude) > @{name}_bits(limit);
}

/* Returns true if x is outside low ... high, 0 <= low, or NaN; -0 is 0. */
static bool @{name}_outside(@real x, @real low, @real high)
{
    const @whole span = @{name}_bits(high) - @{name}_bits(low);
    return @{name}_bits(x) - @{name}_bits(low) > span
        && (@{name}_bits(x) | @{name}_bits(low)) != ~@magnitude;
}

/* Returns x clamped to low ... high, or safe if x is not finite; sets bits of the status. */
static @real @{name}_mended(
    @real x, @real low, @real high, @real safe,
    unsigned int clamped, unsigned int not_finite, unsigned int *status)
{
    @real found = x;
    if (@{name}_beyond(x, @largest)) {
        *status |= not_finite;
        found = safe;
    } else if (x < low) {
        *status |= clamped;
        found = low;
    } else if (x > high) {
        *status |= clamped;
        found = high;
    } else {
        /* within the range */
    }
    return found;
}
