/* The limit of W1: Monte Carlo of one four-bar in closed form, written by hand for this linkage and nothing else.
 *
 * Blocks of 64 samples; every loop over a block is left to the compiler's vectoriser (-O3 -march=native -ffast-math).
 * All numbers in SI units. Offsets of a sample, in this order: x and y of the pins J1..J4 (ground axes), deviations of
 * crank, coupler and rocker. Errors: x, y of the rocker-side pin J3, angle of the rocker.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { N = 64, OFFSETS = 11, QUANTITIES = 5, BINS = 1024, LANES = 16 };

typedef double Block[N];

/* Everything that does not vary from sample to sample. */
typedef struct {
    double pivot_x, pivot_y;        /* of the rocker */
    double crank, coupler, rocker;  /* lengths */
    double cosine, sine;            /* of the crank's angle */
    double side;                    /* +1 or -1: which of the two assemblies */
    double x, y, along_x, along_y;  /* nominal output: pin, direction of the rocker */
    double radius;                  /* of every pin's play */
    double tolerance;               /* of every length; normal, three sigma, truncated */
    double low[QUANTITIES], density[QUANTITIES]; /* of the histograms */
} Linkage;

typedef struct {
    double count, failed, sum[3], product[6], largest[QUANTITIES];
    uint64_t bins[QUANTITIES * BINS];
} Statistics;

/* xoshiro256++ (Blackman and Vigna 2021), one stream per lane. */
typedef struct { uint64_t a[LANES], b[LANES], c[LANES], d[LANES]; } Stream;

static inline uint64_t mixed(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static void seeded(Stream *s, uint64_t seed) {
    for (int i = 0; i < LANES; i++) {
        s->a[i] = mixed(seed += 0x9E3779B97F4A7C15u);
        s->b[i] = mixed(seed += 0x9E3779B97F4A7C15u);
        s->c[i] = mixed(seed += 0x9E3779B97F4A7C15u);
        s->d[i] = mixed(seed += 0x9E3779B97F4A7C15u);
    }
}

static inline void bits(Stream *restrict s, uint64_t *restrict out, int n) {
    for (int at = 0; at < n; at += LANES)
        for (int i = 0; i < LANES; i++) {
            uint64_t a = s->a[i], b = s->b[i], c = s->c[i], d = s->d[i], t = b << 17;
            uint64_t sum = a + d;
            out[at + i] = ((sum << 23) | (sum >> 41)) + a;
            c ^= a; d ^= b; b ^= c; a ^= d; c ^= t;
            s->a[i] = a; s->b[i] = b; s->c[i] = c; s->d[i] = (d << 45) | (d >> 19);
        }
}

static inline double from_bits(uint64_t bits) { double d; memcpy(&d, &bits, 8); return d; }
static inline uint64_t to_bits(double d) { uint64_t b; memcpy(&b, &d, 8); return b; }
static inline double unit(uint64_t bits) { return from_bits((bits >> 12) | 0x3FF0000000000000u) - 1.0; }

/* A point of the unit circle: 52 bits give an angle within an eighth of a turn, two more the quarter. */
static inline void circle(uint64_t bits, double *x, double *y) {
    double a = (from_bits((bits >> 12) | 0x4000000000000000u) - 3.0) * 0.78539816339744831, q = a * a;
    double s = a + a * q * (-1.0 / 6 + q * (1.0 / 120 + q * (-1.0 / 5040 + q * (1.0 / 362880
             + q * (-1.0 / 39916800 + q * (1.0 / 6227020800.0 - q * (1.0 / 1307674368000.0)))))));
    double c = 1 + q * (-0.5 + q * (1.0 / 24 + q * (-1.0 / 720 + q * (1.0 / 40320 + q * (-1.0 / 3628800
             + q * (1.0 / 479001600 - q * (1.0 / 87178291200.0)))))));
    uint64_t swap = -(bits & 1), flip = (bits & 2) << 62;
    *x = from_bits(((to_bits(-s) & swap) | (to_bits(c) & ~swap)) ^ flip);
    *y = from_bits(((to_bits(c) & swap) | (to_bits(s) & ~swap)) ^ flip);
}

static inline void disc(Stream *s, double radius, double *restrict x, double *restrict y) {
    uint64_t far[N], round[N];
    bits(s, far, N);
    bits(s, round, N);
    for (int i = 0; i < N; i++) {
        double r = radius * sqrt(unit(far[i])), cx, cy;
        circle(round[i], &cx, &cy);
        x[i] = r * cx;
        y[i] = r * cy;
    }
}

/* 2 n standard normal numbers (Box and Muller). */
static inline void normals(Stream *s, double *restrict x, double *restrict y, int n) {
    uint64_t far[N], round[N];
    bits(s, far, n);
    bits(s, round, n);
    for (int i = 0; i < n; i++) {
        double r = sqrt(-2.0 * log(1.0 - unit(far[i]))), cx, cy;
        circle(round[i], &cx, &cy);
        x[i] = r * cx;
        y[i] = r * cy;
    }
}

/* Draws again what lies beyond three sigma: about one in 370. */
static inline void truncated(Stream *s, double *values) {
    int outside = 0;
    for (int i = 0; i < N; i++) outside |= fabs(values[i]) > 3.0;
    while (outside) {
        Block x, y;
        normals(s, x, y, N);
        outside = 0;
        for (int i = 0; i < N; i++) {
            values[i] = fabs(values[i]) > 3.0 ? x[i] : values[i];
            outside |= fabs(values[i]) > 3.0;
        }
    }
}

static inline void draw(const Linkage *l, Stream *s, Block *u) {
    for (int joint = 0; joint < 4; joint++) disc(s, l->radius, u[2 * joint], u[2 * joint + 1]);
    normals(s, u[8], u[9], N);
    normals(s, u[10], u[10] + N / 2, N / 2);
    double sigma = l->tolerance / 3.0;
    for (int k = 8; k < 11; k++) {
        truncated(s, u[k]);
        for (int i = 0; i < N; i++) u[k][i] *= sigma;
    }
}

/* The two circles about the coupler's end of the crank and the rocker's pivot. Not assembled: weight zero. */
static inline void solve(const Linkage *l, Block *u, Block *error, double *weight) {
    for (int i = 0; i < N; i++) {
        double crank = l->crank + u[8][i], coupler = l->coupler + u[9][i], rocker = l->rocker + u[10][i];
        double qx = l->pivot_x + u[6][i], qy = l->pivot_y + u[7][i];
        double dx = u[0][i] + crank * l->cosine + u[2][i] + u[4][i] - qx;
        double dy = u[1][i] + crank * l->sine + u[3][i] + u[5][i] - qy;
        double square = dx * dx + dy * dy, inverse = 1.0 / square;
        double along = 0.5 * (1.0 + (rocker * rocker - coupler * coupler) * inverse);
        double rest = rocker * rocker * inverse - along * along;
        double across = l->side * sqrt(rest > 0 ? rest : 0);
        double rx = along * dx - across * dy, ry = along * dy + across * dx;
        double turned = (l->along_x * ry - l->along_y * rx) / rocker, q = turned * turned;
        weight[i] = rest > 0 ? 1.0 : 0.0;
        error[0][i] = qx + rx - l->x;
        error[1][i] = qy + ry - l->y;
        /* The arc sine of a small angle. */
        error[2][i] = turned * (1 + q * (1.0 / 6 + q * (3.0 / 40 + q * (15.0 / 336))));
    }
}

static inline void count(const Linkage *l, Block *error, const double *weight, Statistics *restrict out,
                         Block *restrict sums, Block *restrict largest) {
    for (int i = 0; i < N; i++) {
        double x = error[0][i] * weight[i], y = error[1][i] * weight[i], t = error[2][i] * weight[i];
        sums[0][i] += x; sums[1][i] += y; sums[2][i] += t;
        sums[3][i] += x * x; sums[4][i] += x * y; sums[5][i] += y * y;
        sums[6][i] += x * t; sums[7][i] += y * t; sums[8][i] += t * t;
        sums[9][i] += weight[i];
        error[3][i] = sqrt(x * x + y * y);
        error[4][i] = fabs(t);
    }
    for (int k = 0; k < QUANTITIES; k++) {
        uint32_t place[N];
        uint64_t *bins = out->bins + k * BINS;
        for (int i = 0; i < N; i++) {
            double p = (error[k][i] - l->low[k]) * l->density[k], size = fabs(error[k][i]) * weight[i];
            p = p > 0 ? p : 0;
            place[i] = (uint32_t)(p < BINS - 1 ? p : BINS - 1);
            largest[k][i] = size > largest[k][i] ? size : largest[k][i];
        }
        for (int i = 0; i < N; i++) bins[place[i]] += (uint64_t)weight[i];
    }
}

/* n samples, a multiple of 64: drawn, solved, counted; with fewer phases than three only the first ones. */
void monte_carlo(const Linkage *l, uint64_t seed, int64_t n, int phases, Statistics *out) {
    Block u[OFFSETS], error[QUANTITIES], weight;
    Block sums[10], largest[QUANTITIES];
    Stream stream;
    memset(sums, 0, sizeof sums);
    memset(largest, 0, sizeof largest);
    memset(out, 0, sizeof *out);
    seeded(&stream, seed);
    for (int64_t at = 0; at < n; at += N) {
        draw(l, &stream, u);
        if (phases < 2) continue;
        solve(l, u, error, weight);
        if (phases < 3) continue;
        count(l, error, weight, out, sums, largest);
    }
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) out->sum[k] += sums[k][i];
        for (int k = 0; k < 6; k++) out->product[k] += sums[3 + k][i];
        for (int k = 0; k < QUANTITIES; k++)
            if (largest[k][i] > out->largest[k]) out->largest[k] = largest[k][i];
        out->count += sums[9][i];
    }
    out->failed = (double)n - out->count;
}

/* The same closed form for offsets that are given: n rows of 11, n rows of 3 out; n is a multiple of 64. */
void solve_given(const Linkage *l, int64_t n, const double *offsets, double *errors) {
    Block u[OFFSETS], error[QUANTITIES], weight;
    for (int64_t at = 0; at < n; at += N) {
        for (int k = 0; k < OFFSETS; k++)
            for (int i = 0; i < N; i++) u[k][i] = offsets[(at + i) * OFFSETS + k];
        solve(l, u, error, weight);
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < N; i++) errors[(at + i) * 3 + k] = weight[i] > 0 ? error[k][i] : NAN;
    }
}
