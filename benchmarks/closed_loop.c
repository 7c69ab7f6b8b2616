/* One closed-loop run of the waist-shoulder-elbow arm, every effect of the rigid kernel compiled in: what the speed of
   the Python one is measured against. Same algorithm, same expressions (three_joint.h), column numbers from layout.h,
   which the benchmark writes. The effective parameters (body) come from the caller: they are formed once a run. */
#include <math.h>
#include <string.h>
#include "layout.h"
#include "three_joint.h"

#define N 3
enum { POSITION, SPEED, DEFLECTION, STUCK, CURRENT, ROTOR_POSITION, ROTOR_SPEED, RISE, STATE };
enum { SUM, LAST_ERROR, MEMORY = 5 };
#define QUEUE 16

static inline double clamped(double x, double limit) { return x > limit ? limit : (x < -limit ? -limit : x); }
static inline double outside(double x, double w) { return x > w ? x - w : (x < -w ? x + w : 0.0); }
static inline double amplified(double u, const double *j) {
  return clamped(outside(fabs(u) > j[THRESHOLD] ? u : 0.0, j[DEAD_ZONE]), j[SUPPLY]);
}
static inline double risen(double t, const double *j) { return j[TIMED_RISE] != 0 ? j[TIMED_RISE] * (1.0 - exp(-t / j[RISING_TIME])) : 0.0; }
static inline double torque_constant(const double *j) { return j[TORQUE_CONSTANT] * (1.0 - j[FLUX_LOSS]); }
static inline double back_emf(const double *j) { return j[BACK_EMF] * (1.0 - j[FLUX_LOSS]); }
static inline double motor_gain(const double *j, double rise) {
  return j[GEAR] * torque_constant(j) / (j[RESISTANCE] * (1.0 + rise));
}
static inline double motor_damping(const double *j, double rise) {
  return j[GEAR] * j[GEAR] * (torque_constant(j) * back_emf(j) / (j[RESISTANCE] * (1.0 + rise)) + j[VISCOUS]);
}
static inline double steady_current(const double *j, double rise, double volts, double speed) {
  return (volts - back_emf(j) * j[GEAR] * speed) / (j[RESISTANCE] * (1.0 + rise));
}
static inline double deflection(double z, double moved, double soft, double shape) {
  if (shape == 0) return clamped(z + moved * soft, 1.0);
  const double x = fabs(moved) * soft, y = shape * x, rise = 1.0 + y * (0.5 + y * (1.0 / 6.0)), kept = 1.0 / (1.0 + y * rise);
  const double gain = x * rise * kept;
  return clamped(z * kept + (moved >= 0 ? gain : -gain), 1.0);
}
static inline void winding_functions(double x, double *f) {
  if (x < 0.05) {
    f[2] = 1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0 - x / 5040.0)));
    f[1] = 0.5 - x * f[2];
    f[0] = 1.0 - x * f[1];
  } else {
    f[0] = (1.0 - exp(-x)) / x;
    f[1] = (1.0 - f[0]) / x;
    f[2] = (0.5 - f[1]) / x;
  }
}
static inline double stage_current(const double *j, const double *s, double volts, double begun, double speed, int stage, double h) {
  const double x = j[RESISTANCE] * (1.0 + s[RISE]) / j[INDUCTANCE] * h, half = exp(-0.5 * x);
  const double before = steady_current(j, s[RISE], volts, begun), settled = steady_current(j, s[RISE], volts, speed);
  const double excess = s[CURRENT] - before, change = before - settled;
  double f[3];
  winding_functions(x, f);
  if (stage == 0) return settled + excess * (6.0 * f[1] - 2.0 * half);
  if (stage == 3) return settled + excess * (6.0 * (f[0] - f[1]) - 2.0 * half) + change * (6.0 * f[1] - 12.0 * f[2]);
  return settled + excess * half + change * 6.0 * f[2];
}
static inline double current_after(const double *j, const double *s, double volts, double begun, double speed, double h) {
  const double x = j[RESISTANCE] * (1.0 + s[RISE]) / j[INDUCTANCE] * h;
  const double before = steady_current(j, s[RISE], volts, begun), settled = steady_current(j, s[RISE], volts, speed);
  double f[3];
  winding_functions(x, f);
  return settled + (s[CURRENT] - before) * (1.0 - x * f[0]) + (before - settled) * f[0];
}

static double sensed_angle(double q, const double *j) {
  double s = q + j[POTENTIOMETER_GAIN] * (q - j[AT_ZERO] - 0.5 * j[RANGE]) + j[POTENTIOMETER_OFFSET];
  const double w = M_PI * (q - j[AT_ZERO]) / j[RANGE];
  for (int k = 0; k < 8; k++)
    if (j[BEND_1 + k] != 0) s += j[BEND_1 + k] * sin((k + 1) * w);
  return s;
}

static double extra_torque(const double *j, long flags, double t, double q, double v, double z, double stuck, double motor) {
  double torque = 0;
  if (flags & HAS_STICTION) torque -= z * stuck * j[BREAKAWAY];
  if (j[STRIBECK] != 0) torque -= z * j[STRIBECK] * exp(-fabs(v) / j[STRIBECK_SPEED]);
  if (j[DIRECTION] * z > 0) torque -= fabs(j[DIRECTION]) * z;
  if (j[VISCOUS_DIRECTION] * v > 0) torque -= j[GEAR] * j[GEAR] * fabs(j[VISCOUS_DIRECTION]) * v;
  if (j[GEAR_LOSS] != 0) torque -= z * j[GEAR_LOSS] * fabs(motor);
  if (j[GEAR_LOSS_DIRECTION] * motor * z > 0) torque -= z * fabs(j[GEAR_LOSS_DIRECTION]) * fabs(motor);
  if (j[RIPPLE_SINE] != 0 || j[RIPPLE_COSINE] != 0)
    torque += j[RIPPLE_SINE] * sin(j[RIPPLE_CYCLES] * q) + j[RIPPLE_COSINE] * cos(j[RIPPLE_CYCLES] * q);
  if (j[SPRING] != 0) torque -= j[SPRING] * (q - j[SPRING_REST]);
  if (j[CABLE] * (q - j[CABLE_REST]) > 0) torque -= fabs(j[CABLE]) * (q - j[CABLE_REST]);
  if (j[DISTURBANCE_SINE] != 0 || j[DISTURBANCE_COSINE] != 0) {
    const double w = 2 * M_PI * j[DISTURBANCE_FREQUENCY] * t;
    torque += j[DISTURBANCE_SINE] * sin(w) + j[DISTURBANCE_COSINE] * cos(w);
  }
  return torque;
}

static double special(const double *j, long flags, int stage, double t, double h, double q, double v, double begun, double z,
                      const double *s, double volts) {
  const double steady = steady_current(j, s[RISE], volts, v);
  const double now = flags & HAS_INDUCTANCE ? stage_current(j, s, volts, begun, v, stage, h) : steady;
  const double k = j[GEAR] * torque_constant(j), through = k * now - j[GEAR] * j[GEAR] * j[VISCOUS] * v;
  return k * (now - steady) + extra_torque(j, flags, t, q, v, z, s[STUCK], through);
}

static void after_step(double *s, const double *j, long flags, double level, double change, double volts, double h) {
  if (flags & HAS_INDUCTANCE) s[CURRENT] = current_after(j, s, volts, s[SPEED] - change, s[SPEED], h);
  if (flags & HAS_STICTION) {
    if (s[STUCK] > 0.5) {
      if (fabs(s[DEFLECTION]) >= 1.0) s[STUCK] = 0;
    } else if (fabs(s[SPEED]) < 1e-3 || s[SPEED] * s[DEFLECTION] < 0) {
      const double whole = level + j[BREAKAWAY];
      if (whole > 0) s[DEFLECTION] *= level / whole;
      s[STUCK] = 1;
    }
  }
}

static inline void solve(const double *m, const double *t, double *restrict a) {
  const double r = 1.0 / m[0], l2 = m[1] * r, l3 = m[2] * r;
  const double e22 = m[3] - l2 * m[1], e23 = m[4] - l2 * m[2], e33 = m[5] - l3 * m[2];
  const double b1 = t[0] - m[6], b2 = t[1] - m[7] - l2 * b1, b3 = t[2] - m[8] - l3 * b1;
  const double d = 1.0 / (e22 * e33 - e23 * e23);
  a[1] = (e33 * b2 - e23 * b3) * d;
  a[2] = (e22 * b3 - e23 * b2) * d;
  a[0] = (b1 - m[1] * a[1] - m[2] * a[2]) * r;
}

static void advance(double s[N][STATE], const double *volts, double start, double duration, long steps,
                    const double p[N][PER_JOINT], const double *body, const long *flags) {
  const double h = duration / steps, reaches[4] = {0, 0.5 * h, 0.5 * h, h}, weights[4] = {1, 2, 2, 1};
  const int tilted = body[17] != 0 || body[18] != 0, is_special = (flags[0] | flags[1] | flags[2]) != 0;
  const int rubs = p[0][GRAVITY_SHARE] != 0 || p[1][GRAVITY_SHARE] != 0 || p[2][GRAVITY_SHARE] != 0;
  double drive[N], damping[N], soft[N], q[N], v[N], z[N];
  for (int j = 0; j < N; j++) {
    drive[j] = motor_gain(p[j], s[j][RISE]) * volts[j];
    damping[j] = motor_damping(p[j], s[j][RISE]);
    soft[j] = 1.0 / p[j][PRESLIDING];
    q[j] = s[j][POSITION]; v[j] = s[j][SPEED]; z[j] = s[j][DEFLECTION];
  }
  for (long step = 0; step < steps; step++) {
    double a[N] = {0}, u[N], qs[N] = {0}, vs[N] = {0}, dq[N] = {0}, level[N];
    for (int j = 0; j < N; j++) u[j] = v[j];
    for (int stage = 0; stage < 4; stage++) {
      const double reach = reaches[stage];
      if (stage > 0)
        for (int j = 0; j < N; j++) { dq[j] = reach * u[j]; u[j] = v[j] + reach * a[j]; }
      const double t2 = q[1] + dq[1] + p[1][THETA], t3 = q[2] + dq[2] + p[2][THETA];
      const double along2 = body[22] * sin(t2), along3 = body[23] * sin(t2 + t3);
      level[0] = p[0][COULOMB] + p[0][COULOMB_ARM] * fabs(along2 * cos(t2) + along3 * cos(t2 + t3));
      level[1] = p[1][COULOMB] + p[1][COULOMB_ARM] * fabs(along2 + along3 * cos(t3));
      level[2] = p[2][COULOMB] + p[2][COULOMB_ARM] * fabs(along3);
      if (rubs) {
        double weight[3];
        gravity_torques(q[0] + dq[0] + p[0][THETA], t2, t3, body, weight);
        for (int j = 0; j < N; j++) level[j] += p[j][GRAVITY_SHARE] * fabs(weight[j]);
      }
      double torque[N], y[N], m[9];
      for (int j = 0; j < N; j++) {
        y[j] = deflection(z[j], dq[j], soft[j], p[j][PRESLIDING_SHAPE]);
        torque[j] = drive[j] - damping[j] * u[j] - y[j] * level[j];
      }
      if (is_special)
        for (int j = 0; j < N; j++)
          torque[j] += special(p[j], flags[j], stage, start + step * h + reach, h, q[j] + dq[j], u[j], v[j], y[j], s[j], volts[j]);
      if (tilted) {
        double b[3];
        horizontal_gravity_torques(q[0] + dq[0] + p[0][THETA], t2, t3, body, b);
        for (int j = 0; j < N; j++) torque[j] -= b[j];
      }
      mass_matrix_and_bias(t2, t3, u[0], u[1], u[2], body, m);
      solve(m, torque, a);
      for (int j = 0; j < N; j++) { qs[j] += weights[stage] * u[j]; vs[j] += weights[stage] * a[j]; }
    }
    for (int j = 0; j < N; j++) {
      dq[j] = h / 6.0 * qs[j];
      q[j] += dq[j];
      v[j] += h / 6.0 * vs[j];
      z[j] = deflection(z[j], dq[j], soft[j], p[j][PRESLIDING_SHAPE]);
    }
    if (is_special)
      for (int j = 0; j < N; j++) {
        s[j][DEFLECTION] = z[j]; s[j][SPEED] = v[j];
        after_step(s[j], p[j], flags[j], level[j], h / 6.0 * vs[j], volts[j], h);
        z[j] = s[j][DEFLECTION];
      }
  }
  for (int j = 0; j < N; j++) { s[j][POSITION] = q[j]; s[j][SPEED] = v[j]; s[j][DEFLECTION] = z[j]; }
}

static double warmed(double rise, double hot, double volts, double begun, double ended, double mean, double t, const double *j) {
  const double i = steady_current(j, hot, volts, mean);
  const double change = steady_current(j, hot, volts, ended) - steady_current(j, hot, volts, begun);
  const double kept = exp(-t / j[COOLING_TIME]);
  return rise * kept + j[HEATING] * (i * i + change * change / 12.0) * j[COOLING_TIME] * (1.0 - kept);
}

static double board_pid(double error, const double *g, const double *j, long quantise, double *memory) {
  double share = memory[SUM] / 64.0;
  if (quantise) share = floor(share);
  double power = g[GAIN_SCALE] * (1.0 + j[GAIN_ERROR]) * (g[GAIN_P] * error + share + g[GAIN_D] * (error - memory[LAST_ERROR]));
  if (quantise) power = floor(power + 0.5);
  const double growth = g[GAIN_I] * error;
  if (!((power >= 127 && growth > 0) || (power <= -127 && growth < 0))) memory[SUM] += growth;
  memory[LAST_ERROR] = error;
  return clamped(power, 127.0);
}

void run(long periods, const double *set_points, const double *noise, const double *initial, const double *first_drive,
         const double *shared, const double p[N][PER_JOINT], const double *gains, const double *body, const long *modes,
         const double *deflection, long quantise, double longest, double *out) {
  double s[N][STATE], memory[N][MEMORY], queue[QUEUE][N], volts[N], times[N];
  long order[N], late[N], flags[N];
  memset(s, 0, sizeof s); memset(memory, 0, sizeof memory);
  for (int j = 0; j < N; j++) {
    const double delay = shared[DELAY] + p[j][EXTRA_DELAY];
    late[j] = (long)floor(delay / shared[PERIOD] + 1e-12);
    times[j] = delay - late[j] * shared[PERIOD];
    int i = j;
    for (; i > 0 && times[order[i - 1]] > times[j]; i--) order[i] = order[i - 1];
    order[i] = j;
    flags[j] = modes[j];
    const int extras[] = {STRIBECK, DIRECTION, VISCOUS_DIRECTION, GEAR_LOSS, GEAR_LOSS_DIRECTION, RIPPLE_SINE, RIPPLE_COSINE, SPRING, CABLE, DISTURBANCE_SINE, DISTURBANCE_COSINE};
    for (unsigned e = 0; e < sizeof extras / sizeof *extras; e++)
      if (p[j][extras[e]] != 0) flags[j] |= HAS_EXTRA_TORQUE;
    for (int k = 0; k < QUEUE; k++) queue[k][j] = first_drive[j];
    volts[j] = amplified(first_drive[j], p[j]);
    s[j][POSITION] = initial[2 * j]; s[j][SPEED] = initial[2 * j + 1];
    s[j][STUCK] = 1; s[j][DEFLECTION] = deflection[j];
    s[j][CURRENT] = steady_current(p[j], 0, volts[j], initial[2 * j + 1]);
  }
  for (long k = 0; k < periods; k++) {
    for (int j = 0; j < N; j++) {
      double read = (sensed_angle(s[j][POSITION], p[j]) - p[j][AT_ZERO]) / p[j][RAD_PER_COUNT] + noise[k * N + j];
      if (quantise) read = floor(read + 0.5);
      const double now = set_points[k * N + j], before = set_points[(k > 0 ? k - 1 : 0) * N + j];
      const double error = now - p[j][LOST] * (now - before) - read;
      if (k == 0) memory[j][LAST_ERROR] = error;
      const double power = board_pid(error, gains + GAINS * j, p[j], quantise, memory[j]);
      const double values[6] = {s[j][POSITION], s[j][SPEED], p[j][AT_ZERO] + p[j][RAD_PER_COUNT] * read,
                                error * p[j][RAD_PER_COUNT], power, power * p[j][VOLTS_PER_COUNT]};
      for (int o = 0; o < 6; o++) out[(o * periods + k) * N + j] = values[o];
      queue[k % QUEUE][j] = values[5];
    }
    double done = 0;
    for (int i = 0; i <= N; i++) {
      const double until = i < N ? times[order[i]] : shared[PERIOD];
      if (until != done) {
        const long wanted = (long)fmax(1, ceil((until - done) / longest - 1e-9));
        long pieces = 1;
        for (int j = 0; j < N; j++)
          if (p[j][HEATING] != 0 || p[j][TIMED_RISE] != 0) pieces = wanted;
        const double t = (until - done) / pieces;
        for (long piece = 0; piece < pieces; piece++) {
          const double start = k * shared[PERIOD] + done + piece * t;
          double begun[N][3];
          for (int j = 0; j < N; j++) {
            const double v = s[j][SPEED], rise = s[j][RISE];
            begun[j][0] = s[j][POSITION]; begun[j][1] = v; begun[j][2] = rise;
            if (p[j][HEATING] != 0) s[j][RISE] = warmed(rise, rise + risen(start, p[j]), volts[j], v, v, v, 0.5 * t, p[j]);
            s[j][RISE] += risen(start + 0.5 * t, p[j]);
          }
          advance(s, volts, start, t, wanted / pieces, p, body, flags);
          for (int j = 0; j < N; j++)
            if (p[j][HEATING] != 0)
              s[j][RISE] = warmed(begun[j][2], s[j][RISE], volts[j], begun[j][1], s[j][SPEED], (s[j][POSITION] - begun[j][0]) / t, t, p[j]);
            else s[j][RISE] = begun[j][2];
        }
      }
      done = until;
      if (i < N) {
        const long j = order[i];
        volts[j] = amplified(queue[(k - late[j] + QUEUE) % QUEUE][j], p[j]);
      }
    }
  }
}

void run_many(long first, long last, long periods, const double *set_points, const double *noise, const double *initial,
              const double *first_drive, const double *shared, const double *p, const double *gains, const double *body,
              const long *modes, const double *deflection, long quantise, double longest, double *out) {
  for (long r = first; r < last; r++)
    run(periods, set_points, noise, initial, first_drive, shared + r * SHARED,
        (const double(*)[PER_JOINT])(p + r * N * PER_JOINT), gains, body, modes, deflection, quantise, longest,
        out + r * 6 * periods * N);
}
