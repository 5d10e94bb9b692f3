/* x / 2^shift, rounded. */
static inline int32_t @{name}_round(int32_t x, int shift)
{
    return (x + ((int32_t)1 << (shift - 1))) >> shift;
}

/* a b / 2^shift, rounded. */
static inline int32_t @{name}_mul(int32_t a, int32_t b, int shift)
{
    return (int32_t)(((int64_t)a * b + ((int64_t)1 << (shift - 1))) >> shift);
}

/* x, or the nearer end of low ... high. */
static inline int32_t @{name}_clamp(int32_t x, int32_t low, int32_t high)
{
    return x < low ? low : (x > high ? high : x);
}

/* x 2^shift, clamped to +-limit; a negative shift rounds. */
static int32_t @{name}_limit(int32_t x, int shift, int32_t limit)
{
    const int32_t low = shift < 0 && shift >= -30 ? @{name}_round(x, -shift) : 0;
    const int64_t y = shift < 0 ? low : (int64_t)x * ((int64_t)1 << shift);
    return y < -limit ? -limit : (y > limit ? limit : (int32_t)y);
}

/* The smaller of a and b. */
static inline int32_t @{name}_min(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

/* The larger of a and b. */
static inline int32_t @{name}_max(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

/* |x| */
static inline int32_t @{name}_abs(int32_t x)
{
    return x < 0 ? -x : x;
}

/* Number of leading zeros of x > 0. */
static inline int @{name}_zeros(uint32_t x)
{
#ifdef __GNUC__
    return __builtin_clz(x);
#else
    int count = 0;
    while (x < 0x80000000u) {
        x <<= 1;
        count++;
    }
    return count;
#endif
}

/* 2^63 / m for m >= 2^31, by Newton's iteration from a linear guess. */
static uint32_t @{name}_inverse(uint32_t m)
{
    uint32_t x = 0xB4B4B4B4u - (uint32_t)(((uint64_t)m * 0x78787878u) >> 32);
    x = (uint32_t)(((uint64_t)x * (0x80000000u - (uint32_t)(((uint64_t)x * m) >> 32))) >> 30);
    x = (uint32_t)(((uint64_t)x * (0x80000000u - (uint32_t)(((uint64_t)x * m) >> 32))) >> 30);
    x = (uint32_t)(((uint64_t)x * (0x80000000u - (uint32_t)(((uint64_t)x * m) >> 32))) >> 30);
    return x < 0x7FFFFFFFu ? 2u * x : 0xFFFFFFFFu;
}

/* a / b 2^shift, rounded, for b other than 0; 0 if a is 0. */
static int32_t @{name}_div(int32_t a, int32_t b, int shift)
{
    const uint32_t size = (uint32_t)(b < 0 ? -b : b);
    const int zeros = @{name}_zeros(size | 1u);
    const int64_t product = (int64_t)@{name}_inverse(size << zeros) * (b < 0 ? -a : a);
    const int right = 62 - shift - zeros;
    return right < 0 || right > 62 ? 0 : (int32_t)(((product >> right) + 1) >> 1);
}

/* 2^u, times 2^29: polynomials of t in -1 ... 1 for each sixteenth of 0 <= u < 1. */
static const int32_t @{name}_powers[16][5] = {
    {548626854, 11883724, 128706, 929, 5},
    {572916640, 12409861, 134404, 970, 5},
    {598281827, 12959293, 140355, 1013, 5},
    {624770026, 13533049, 146569, 1058, 6},
    {652430958, 14132209, 153058, 1105, 6},
    {681316545, 14757895, 159834, 1154, 6},
    {711481005, 15411283, 166911, 1205, 7},
    {742980960, 16093599, 174301, 1259, 7},
    {775875538, 16806123, 182017, 1314, 7},
    {810226483, 17550194, 190076, 1372, 7},
    {846098274, 18327207, 198491, 1433, 8},
    {883558244, 19138622, 207279, 1497, 8},
    {922676710, 19985961, 216456, 1563, 8},
    {963527098, 20870815, 226040, 1632, 9},
    {1006186087, 21794845, 236047, 1704, 9},
    {1050733751, 22759786, 246498, 1780, 10},
};

/* atan u, times 2^29: polynomials of t in -1 ... 1 for each sixteenth of 0 <= u < 1. */
static const int32_t @{name}_angles[16][5] = {
    {16771758, 16760847, -16352, -5425, 16},
    {50184965, 16631044, -48299, -5176, 46},
    {83213242, 16377377, -78062, -4705, 71},
    {115619285, 16011061, -104452, -4064, 88},
    {147192530, 15547393, -126630, -3314, 98},
    {177755853, 15004253, -144146, -2522, 99},
    {207169181, 14400561, -156921, -1745, 94},
    {235330149, 13754900, -165191, -1027, 85},
    {262172294, 13084440, -169410, -399, 72},
    {287661468, 12404238, -170166, 125, 59},
    {311791193, 11726874, -168099, 543, 46},
    {334577593, 11062376, -163834, 859, 34},
    {356054396, 10418356, -157950, 1086, 23},
    {376268345, 9800268, -150945, 1235, 15},
    {395275197, 9211726, -143239, 1323, 8},
    {413136383, 8654846, -135164, 1361, 2},
};

/* sin(pi u / 2), times 2^30: polynomials of t in -1 ... 1 for each sixteenth of 0 <= u < 1. */
static const int32_t @{name}_sines[16][5] = {
    {52686014, 52643690, -63475, -21138, 13},
    {157550647, 52136702, -189815, -20935, 38},
    {260897982, 51127610, -314326, -20530, 63},
    {361732726, 49626130, -435810, -19927, 88},
    {459083786, 47646724, -553098, -19132, 111},
    {552013618, 45208454, -665058, -18153, 134},
    {639627258, 42334802, -770614, -16999, 155},
    {721080937, 39053443, -868748, -15681, 174},
    {795590213, 35395977, -958516, -14213, 192},
    {862437520, 31397629, -1039052, -12607, 209},
    {920979082, 27096905, -1109582, -10880, 223},
    {970651112, 22535222, -1169427, -9049, 235},
    {1010975242, 17756513, -1218009, -7130, 245},
    {1041563127, 12806800, -1254860, -5142, 252},
    {1062120190, 7733749, -1279627, -3105, 257},
    {1072448455, 2586219, -1292071, -1038, 259},
};

/* log2(1 + u), times 2^30: polynomials of t in -1 ... 1 for each sixteenth of 0 <= u < 1. */
static const int32_t @{name}_logarithms[16][5] = {
    {47667823, 46941876, -711241, 14378, -327},
    {138816582, 44259484, -632278, 12051, -258},
    {224898839, 41867080, -565771, 10200, -207},
    {306448299, 39720050, -509231, 8709, -167},
    {383918542, 37782487, -460762, 7495, -137},
    {457698295, 36025162, -418897, 6497, -113},
    {528123241, 34424044, -382489, 5669, -94},
    {595485245, 32959191, -350630, 4975, -79},
    {660039669, 31613918, -322591, 4390, -67},
    {722011213, 30374157, -297786, 3894, -57},
    {781598637, 29227962, -275735, 3469, -49},
    {838978604, 28165127, -256047, 3104, -42},
    {894308843, 27176877, -238394, 2789, -37},
    {947730758, 26255627, -222505, 2515, -32},
    {999371606, 25394787, -208154, 2275, -28},
    {1049346328, 24588603, -195148, 2065, -25},
};

/* (1 - exp(-u)) / u, times 2^30. */
static const int32_t @{name}_means[16][5] = {
    {1057138014, -16431753, 170717, -1332, 8},
    {1024946857, -15764600, 162924, -1267, 8},
    {994059341, -15127858, 155509, -1205, 7},
    {964416138, -14520049, 148454, -1147, 7},
    {935960793, -13939771, 141740, -1091, 7},
    {908639588, -13385693, 135351, -1039, 6},
    {882401399, -12856549, 129270, -989, 6},
    {857197568, -12351140, 123482, -941, 6},
    {832981777, -11868325, 117971, -896, 5},
    {809709930, -11407020, 112724, -853, 5},
    {787340044, -10966196, 107728, -813, 5},
    {765832143, -10544877, 102970, -774, 5},
    {745148154, -10142133, 98439, -737, 4},
    {725251816, -9757082, 94122, -702, 4},
    {706108590, -9388885, 90010, -669, 4},
    {687685571, -9036747, 86091, -637, 4},
};

/* (1 - (1 - exp(-u)) / u) / u, times 2^30. */
static const int32_t @{name}_seconds[16][5] = {
    {531321926, -5505838, 42880, -267, 1},
    {520479653, -5337483, 41308, -257, 1},
    {509967888, -5175287, 39800, -246, 1},
    {499774566, -5018999, 38353, -236, 1},
    {489888111, -4868381, 36965, -227, 1},
    {480297415, -4723204, 35633, -218, 1},
    {470991815, -4583249, 34354, -209, 1},
    {461961079, -4448306, 33126, -200, 1},
    {453195383, -4318176, 31947, -193, 1},
    {444685295, -4192666, 30815, -185, 1},
    {436421760, -4071594, 29728, -178, 1},
    {428396078, -3954783, 28684, -171, 1},
    {420599898, -3842066, 27681, -164, 1},
    {413025194, -3733280, 26718, -157, 1},
    {405664258, -3628273, 25792, -151, 1},
    {398509681, -3526896, 24902, -145, 1},
};

/* Polynomial of the sixteenth of u / 2^31 that contains u. */
static int32_t @{name}_table(const int32_t rows[16][5], uint32_t u)
{
    const int32_t *row = rows[u >> 27], t = (int32_t)(u & 0x7FFFFFFu) - 0x4000000;
    int32_t y = row[4];
    y = row[3] + @{name}_mul(y, t, 26);
    y = row[2] + @{name}_mul(y, t, 26);
    y = row[1] + @{name}_mul(y, t, 26);
    return row[0] + @{name}_mul(y, t, 26);
}

/* 2^(y / 2^shift) 2^fraction, rounded. */
static int32_t @{name}_exp2(int64_t y, int shift, int fraction)
{
    const int64_t least = -((int64_t)32 << shift);
    const uint64_t turns = (uint64_t)(y - least);
    const uint32_t u = (uint32_t)(turns >> (shift - 31)) & 0x7FFFFFFFu;
    const int right = 61 - fraction - (int)(turns >> shift);
    if (y < least || right > 30) {
        return 0;
    }
    return right > 0 ? @{name}_round(@{name}_table(@{name}_powers, u), right)
                     : @{name}_table(@{name}_powers, u) * ((int32_t)1 << -right);
}

/* exp(x / 2^25) 2^30 for x <= 0. */
static int32_t @{name}_exp(int32_t x)
{
    return x >= 0 ? 0x40000000 : @{name}_exp2((int64_t)x * 1549082005, 55, 30);
}

/* exp(-x / 2^fraction) 2^30 for x >= 0 */
static int32_t @{name}_decay(int32_t x, int fraction)
{
    return x > 0 ? @{name}_exp2((int64_t)x * -1549082005, fraction + 30, 30) : 0x40000000;
}

/* (1 - exp(-x)) / x for x / 2^fraction, times 2^30 */
static int32_t @{name}_phi1(int32_t x, int fraction)
{
    const uint32_t size = x > 0 ? (uint32_t)x : 0u;
    if (size < (uint32_t)1 << fraction) {
        return @{name}_table(@{name}_means, size << (31 - fraction));
    }
    return @{name}_div(0x40000000 - @{name}_decay(x, fraction), x, fraction);
}

/* (1 - phi1(x)) / x for x / 2^fraction, times 2^30 */
static int32_t @{name}_phi2(int32_t x, int fraction)
{
    const uint32_t size = x > 0 ? (uint32_t)x : 0u;
    if (size < (uint32_t)1 << fraction) {
        return @{name}_table(@{name}_seconds, size << (31 - fraction));
    }
    return @{name}_div(0x40000000 - @{name}_phi1(x, fraction), x, fraction);
}

/* tanh(x / 2^26) 2^30 = (1 - s) / (1 + s), s = exp(-2 |x|). */
static int32_t @{name}_tanh(int32_t x)
{
    const int32_t s = @{name}_exp(x < 0 ? x : -x);
    const int64_t scale = @{name}_inverse(0x7FFFFFFFu + 2u * (uint32_t)s + (s < 0x40000000));
    const int32_t y = (int32_t)(((0x40000000 - s) * scale) >> 32);
    return x < 0 ? -y : y;
}

/* atan(x / 2^fraction) 2^29 */
static int32_t @{name}_atan(int32_t x, int fraction)
{
    const uint32_t size = (uint32_t)(x < 0 ? -x : x);
    const int zeros = @{name}_zeros(size | 1u);
    int32_t y;
    if (size < (uint32_t)1 << fraction) {
        y = @{name}_table(@{name}_angles, size << (31 - fraction));
    } else {
        const int right = 32 - fraction - zeros;
        const uint32_t u = @{name}_inverse(size << zeros) >> right;
        y = 843314857 - @{name}_table(@{name}_angles, u > 0x7FFFFFFFu ? 0x7FFFFFFFu : u);
    }
    return x < 0 ? -y : y;
}

/* sin(x / 2^28) 2^30 */
static int32_t @{name}_sin(int32_t x)
{
    const int64_t turn = (int64_t)x * 683565276;
    const uint32_t quarter = (uint32_t)((uint64_t)turn >> 58) & 3u;
    uint32_t u = (uint32_t)((uint64_t)turn >> 27) & 0x7FFFFFFFu;
    int32_t y;
    if ((quarter & 1u) != 0u) {
        u = 0x7FFFFFFFu - u;
    }
    y = @{name}_table(@{name}_sines, u);
    return quarter > 1u ? -y : y;
}

/* log2(x / 2^fraction) 2^26 for x > 0 */
static int64_t @{name}_log2(int32_t x, int fraction)
{
    const int zeros = @{name}_zeros((uint32_t)x | 1u);
    const int32_t part = @{name}_table(@{name}_logarithms, ((uint32_t)x << zeros) & 0x7FFFFFFFu);
    return (int64_t)(31 - zeros - fraction) * 0x4000000 + @{name}_round(part, 4);
}

/* log(x / 2^fraction) 2^(56 - shift) for x > 0, rounded. */
static int32_t @{name}_log(int32_t x, int fraction, int shift)
{
    return (int32_t)((@{name}_log2(x, fraction) * 744261118 + ((int64_t)1 << (shift - 1))) >> shift);
}

/* (x / 2^from)^(power / 2^24) 2^to for x >= 0 */
static int32_t @{name}_pow(int32_t x, int from, int32_t power, int to)
{
    return x <= 0 ? 0 : @{name}_exp2(@{name}_log2(x, from) * power, 50, to);
}

/* sqrt(x 2^shift), bit by bit */
static int32_t @{name}_sqrt(int32_t x, int shift)
{
    uint64_t rest = (uint64_t)(x < 0 ? 0 : x) << shift;
    uint64_t root = 0u, bit = (uint64_t)1 << 62;
    while (bit != 0u) {
        if (rest >= root + bit) {
            rest -= root + bit;
            root = (root >> 1) + bit;
        } else {
            root >>= 1;
        }
        bit >>= 2;
    }
    return (int32_t)root;
}
