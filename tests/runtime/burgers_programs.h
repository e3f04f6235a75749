// SPDX-License-Identifier: Apache-2.0
// Hand-written programs for the periodic 1-D Burgers equation: step, adjoint, loss = sum (u - target)^2 over cells,
// adjoint of the loss. Parameters: hx, dt, nu.
#pragma once

#include "test_program.h"

namespace dpde::test {

/// Uniforms: a = dt / (2 hx), c = nu dt / hx^2, dc = dt / hx^2
inline void burgers_uniforms(const double* params, double* uniforms) {
  const double hx = params[0], dt = params[1], nu = params[2];
  uniforms[0] = dt / (2 * hx);
  uniforms[1] = nu * dt / (hx * hx);
  uniforms[2] = dt / (hx * hx);
}

/// streams: u[-1], u, u[+1], u_next
inline void burgers_row(const dpde_row* row) {
  const Doubles s{row->streams};
  const double *w = s[0], *u = s[1], *e = s[2];
  double* next = s[3];
  const double a = row->uniforms[0], c = row->uniforms[1];
  for (int64_t i = 0; i < row->count; ++i) next[i] = u[i] - a * u[i] * (e[i] - w[i]) + c * (e[i] - 2 * u[i] + w[i]);
}

/// streams: u[-1], u, u[+1], s[-1], s, s[+1] (s = u_next_bar), u_bar; sum nu_bar
inline void burgers_adjoint_row(const dpde_row* row) {
  const Doubles streams{row->streams};
  const double *w = streams[0], *u = streams[1], *e = streams[2];
  const double *sw = streams[3], *s = streams[4], *se = streams[5];
  double* bar = streams[6];
  const double a = row->uniforms[0], c = row->uniforms[1], dc = row->uniforms[2];
  double nu_bar = 0;
  for (int64_t i = 0; i < row->count; ++i) {
    bar[i] = s[i] * (1 - a * (e[i] - w[i]) - 2 * c) + sw[i] * (c - a * w[i]) + se[i] * (c + a * e[i]);
    nu_bar += dc * s[i] * (e[i] - 2 * u[i] + w[i]);
  }
  row->sums[0] += nu_bar;
}

/// streams: u, target; sum loss
inline void square_row(const dpde_row* row) {
  const Doubles s{row->streams};
  double loss = 0;
  for (int64_t i = 0; i < row->count; ++i) {
    const double d = s[0][i] - s[1][i];
    loss += d * d;
  }
  row->sums[0] += loss;
}

inline void loss_uniforms(const double* params, double* uniforms) { uniforms[0] = params[0]; }

/// streams: u, target, u_bar; uniform loss_bar
inline void square_adjoint_row(const dpde_row* row) {
  const Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[2][i] = 2 * row->uniforms[0] * (s[0][i] - s[1][i]);
}

struct BurgersPrograms {
  TestProgram step{"burgers_step", 1, {"u"}, {"u_next"}};
  TestProgram adjoint{"burgers_step_adjoint", 1, {"u", "u_next_bar"}, {"u_bar"}};
  TestProgram loss{"loss", 1, {"u", "target"}};
  TestProgram loss_adjoint{"loss_adjoint", 1, {"u", "target"}, {"u_bar"}};

  explicit BurgersPrograms(dpde_row_fn step_row = burgers_row, dpde_row_fn adjoint_row = burgers_adjoint_row) {
    step.params({"hx", "dt", "nu"}, burgers_uniforms, 3);
    step.halo({1, 0, 0});
    step.prepare(step.fill_of("u"));
    step.sweep(step_row, {{"u", -1}, {"u"}, {"u", 1}, {"u_next"}}, {step.fill_of("u_next")});
    step.swap("u", "u_next");
    adjoint.params({"hx", "dt", "nu"}, burgers_uniforms, 3);
    adjoint.halo({1, 0, 0});
    adjoint.sums({"nu_bar"});
    adjoint.prepare(adjoint.fill_of("u"));
    adjoint.prepare(adjoint.fill_of("u_next_bar"));
    adjoint.sweep(adjoint_row,
                  {{"u", -1}, {"u"}, {"u", 1}, {"u_next_bar", -1}, {"u_next_bar"}, {"u_next_bar", 1}, {"u_bar"}},
                  {adjoint.fill_of("u_bar")}, {"nu_bar"});
    adjoint.swap("u_next_bar", "u_bar");
    adjoint.bars({"u", "u_next"});
    adjoint.link(DPDE_LINK_PARAM, "nu", DPDE_LINK_SUM, "nu_bar");
    loss.sums({"loss"});
    loss.sweep(square_row, {{"u"}, {"target"}}, {}, {"loss"});
    loss_adjoint.params({"loss_bar"}, loss_uniforms, 1);
    loss_adjoint.bars({"u"});
    loss_adjoint.bar_of_loss();
    loss_adjoint.sweep(square_adjoint_row, {{"u"}, {"target"}, {"u_bar"}});
  }
};

}  // namespace dpde::test
