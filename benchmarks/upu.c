/* The limit of W4: error under load of a 3-UPU robot in closed form, written by hand for this robot and nothing else.
 *
 * Leg lengths give the platform's place (three spheres). A leg carries a force F s along its line and a couple M n that
 * is normal to the pins of its joints; plays at the pins' ends and of the guide, each taken up against what it carries,
 * add up to an error of every leg's length and one of every constrained angle, and these to the platform's error.
 *
 * Blocks of 64 configurations; the loop over a block is left to the compiler's vectoriser (-O3 -march=native
 * -ffast-math). All numbers in SI units. Pins on base and platform lie along the circles.
 */
#include <math.h>
#include <stdint.h>

enum { N = 64, LEGS = 3 };

typedef struct {
    double base, platform;               /* radii of the circles */
    double radial, axial, half_pin;      /* of all pins */
    double gap, guide_length, guide_width;
    double force[3], moment[3];          /* on the platform, at its middle */
} Robot;

typedef struct { double x, y, z; } Vec;

static inline Vec cross(Vec a, Vec b) {
    return (Vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vec sum3(double a, Vec u, double b, Vec v, double c, Vec w) {
    return (Vec){a * u.x + b * v.x + c * w.x, a * u.y + b * v.y + c * w.y, a * u.z + b * v.z + c * w.z};
}

static const double COSINE[LEGS] = {1.0, -0.5, -0.5};
static const double SINE[LEGS] = {0.0, 0.86602540378443864676, -0.86602540378443864676};

__attribute__((always_inline)) static inline void
solve(const Robot *r, const double lengths[LEGS], double error[6]) {
    double d = r->base - r->platform, a = lengths[0] * lengths[0], b = lengths[1] * lengths[1];
    double c = lengths[2] * lengths[2], px = (b + c - 2 * a) / (6 * d), py = (c - b) / (2 * sqrt(3.0) * d);
    Vec p = {px, py, sqrt((a + b + c) / 3 - d * d - px * px - py * py)};
    Vec s[LEGS], n[LEGS], lever[LEGS];
    double cosine[LEGS], sine[LEGS];
#pragma GCC unroll 3
    for (int i = 0; i < LEGS; i++) {
        double l = 1 / lengths[i];
        s[i] = (Vec){(p.x - d * COSINE[i]) * l, (p.y - d * SINE[i]) * l, p.z * l};
        Vec pin = {-SINE[i], COSINE[i], 0}, out = {r->platform * COSINE[i], r->platform * SINE[i], 0};
        cosine[i] = dot(s[i], pin);
        sine[i] = sqrt(1 - cosine[i] * cosine[i]);
        n[i] = sum3(1 / sine[i], s[i], -cosine[i] / sine[i], pin, 0, pin);
        lever[i] = cross(out, s[i]);
    }
    /* Cofactors serve statics and kinematics: one is the other's transpose. */
    Vec t[LEGS] = {cross(s[1], s[2]), cross(s[2], s[0]), cross(s[0], s[1])};
    Vec m[LEGS] = {cross(n[1], n[2]), cross(n[2], n[0]), cross(n[0], n[1])};
    double by_s = 1 / dot(s[0], t[0]), by_n = 1 / dot(n[0], m[0]);
    Vec load = {r->force[0], r->force[1], r->force[2]}, couple = {r->moment[0], r->moment[1], r->moment[2]};
    double along[LEGS], long_[LEGS], turn[LEGS];
#pragma GCC unroll 3
    for (int i = 0; i < LEGS; i++) along[i] = -by_s * dot(load, t[i]);
    Vec levers = sum3(along[0], lever[0], along[1], lever[1], along[2], lever[2]);
    couple = (Vec){couple.x + levers.x, couple.y + levers.y, couple.z + levers.z};
#pragma GCC unroll 3
    for (int i = 0; i < LEGS; i++) {
        double f = along[i], moment = -by_n * dot(couple, m[i]), q = moment / r->half_pin;
        double ends = r->radial / sqrt(f * f * sine[i] * sine[i] + q * q);
        double square = f * f + q * q, mixed = 2 * f * q * cosine[i];
        double one = r->radial / sqrt(square - mixed), other = r->radial / sqrt(square + mixed);
        double guide = fmax(2 * sine[i] / r->guide_width, 2 * fabs(cosine[i]) / r->guide_length);
        long_[i] = 2 * (ends * f * sine[i] * sine[i] + r->axial * fabs(cosine[i]) * copysign(1.0, f))
                 + one * (f - q * cosine[i]) + other * (f + q * cosine[i]);
        turn[i] = (2 * ends * q + one * (q - f * cosine[i]) + other * (q + f * cosine[i])) / r->half_pin
                + r->gap * copysign(guide, moment);
    }
    Vec w = sum3(-by_n * turn[0], m[0], -by_n * turn[1], m[1], -by_n * turn[2], m[2]);
#pragma GCC unroll 3
    for (int i = 0; i < LEGS; i++) long_[i] = -by_s * (long_[i] + dot(lever[i], w));
    Vec v = sum3(long_[0], t[0], long_[1], t[1], long_[2], t[2]);
    error[0] = v.x; error[1] = v.y; error[2] = v.z;
    error[3] = w.x; error[4] = w.y; error[5] = w.z;
}

/* Errors of `count` rows of three leg lengths: x, y, z, rx, ry, rz of each. */
void map(const Robot *robot, int64_t count, const double *restrict lengths, double *restrict errors) {
    const Robot r = *robot;
    for (int64_t k = 0; k < count; k += N) {
        int rows = count - k < N ? (int)(count - k) : N;
        double in[LEGS][N], out[6][N];
        for (int i = 0; i < N; i++)
            for (int c = 0; c < LEGS; c++) in[c][i] = lengths[3 * (k + (i < rows ? i : rows - 1)) + c];
#pragma GCC ivdep
        for (int i = 0; i < N; i++) {
            double row[LEGS] = {in[0][i], in[1][i], in[2][i]}, error[6];
            solve(&r, row, error);
            out[0][i] = error[0]; out[1][i] = error[1]; out[2][i] = error[2];
            out[3][i] = error[3]; out[4][i] = error[4]; out[5][i] = error[5];
        }
        for (int i = 0; i < rows; i++)
            for (int c = 0; c < 6; c++) errors[6 * (k + i) + c] = out[c][i];
    }
}
