/* The four-tank in closed loop: two controllers that exchange messages as bytes, and the linear plant. Prints both inputs of every
   step, as numbers and bit by bit. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "four_tank.h"

typedef FOUR_TANK_LEFT_REAL real;

enum { STEPS = 600 };

/* x+ = A x + B u: h1, h2, h3, h4 [cm] and v1, v2 [V], as deviations from the operating point. */
static const double A[4][4] = {
    {0.9921, 0.0, 0.0, 0.0206},
    {0.0, 0.9835, 0.0, 0.0},
    {0.0, 0.0165, 0.9945, 0.0},
    {0.0, 0.0, 0.0, 0.9793},
};
static const double B[4][2] = {{0.0417, 2.47e-4}, {0.0156, 0.0}, {1.30e-4, 0.0311}, {0.0, 0.0235}};

static void advance(double x[4], const double u[2]) {
    double next[4];
    for (int k = 0; k < 4; k++) {
        next[k] = 0.0;
        for (int j = 0; j < 4; j++) next[k] += A[k][j] * x[j];
        for (int j = 0; j < 2; j++) next[k] += B[k][j] * u[j];
    }
    memcpy(x, next, sizeof next);
}

/* Of h1 and h3 [cm]. */
static void set_points(int t, real y[2]) {
    static const double profile[4][2] = {{2.0, 1.0}, {-0.5, 2.5}, {9.0, -0.5}, {0.0, 0.0}};
    for (int k = 0; k < 2; k++) y[k] = (real)profile[t / (STEPS / 4)][k];
}

static void check(int32_t code, const char *what) {
    if (code != DPC_OK) {
        fprintf(stderr, "%s: %s\n", what, four_tank_result_text(code));
        exit(EXIT_FAILURE);
    }
}

static uint64_t bits(real number) {
    uint64_t wide = 0;
    uint32_t narrow = 0;
    if (sizeof number == sizeof wide) {
        memcpy(&wide, &number, sizeof number);
        return wide;
    }
    memcpy(&narrow, &number, sizeof narrow);
    return narrow;
}

static void print(int t, const real u[2], const dpc_status status[2]) {
    printf("%3d  v1 %9.5f V  v2 %9.5f V ", t, (double)u[0], (double)u[1]);
    for (int i = 0; i < 2; i++) printf(" %0*" PRIx64, (int)(2 * sizeof u[i]), bits(u[i]));
    printf("  %" PRId32 " %" PRId32 "  %s\n", status[0].control, status[1].control,
           status[0].guaranteed && status[1].guaranteed ? "guaranteed" : "NOT GUARANTEED");
}

int main(void) {
    four_tank_left left;
    four_tank_right right;
    uint8_t from_left[FOUR_TANK_LEFT_MESSAGE_BYTES];
    uint8_t from_right[FOUR_TANK_RIGHT_MESSAGE_BYTES];

    const real rest[2] = {0.0, 0.0};
    real x_left[2], x_right[2], u[2];
    check(four_tank_left_steady_state(rest, x_left, &u[0]), "rest of left");
    check(four_tank_right_steady_state(rest, x_right, &u[1]), "rest of right");
    check(four_tank_left_start(&left, sizeof left, x_left, &u[0], from_left, NULL), "start of left");
    check(four_tank_right_start(&right, sizeof right, x_right, &u[1], from_right, NULL), "start of right");

    double x[4] = {6.0, 0.0, 0.0, 0.05}; /* off the steady state: the first problems have something to solve */
    for (int t = 0; t < STEPS; t++) {
        const real measured[4] = {(real)x[0], (real)x[1], (real)x[2], (real)x[3]};
        real y[2];
        dpc_status status[2];
        set_points(t, y);
        check(four_tank_left_accept(&left, from_right, sizeof from_right), "message of right");
        check(four_tank_right_accept(&right, from_left, sizeof from_left), "message of left");
        check(four_tank_left_step(&left, &measured[0], &y[0], &u[0], from_left, &status[0]), "step of left");
        check(four_tank_right_step(&right, &measured[2], &y[1], &u[1], from_right, &status[1]), "step of right");
        print(t, u, status);
        const double volts[2] = {(double)u[0], (double)u[1]};
        advance(x, volts);
        if (t == STEPS / 2) x[2] -= 4.0; /* a bucket of water */
    }
    return EXIT_SUCCESS;
}
