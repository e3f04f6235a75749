// SPDX-License-Identifier: Apache-2.0
// Model-level problems by hand, for tests of the lowering that must not depend on the front end.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"

namespace model_builder {

using dpde::BinaryOp;
using dpde::Fn;
using dpde::Topology;
using dpde::model::Expr;
namespace model = dpde::model;

inline Expr make(model::Kind kind) { return Expr(model::Node{std::move(kind), {}}); }
inline Expr param(const std::string& name) { return make(model::Param{name}); }
inline Expr field(const std::string& name) { return make(model::Field{name}); }
inline Expr coordinate(int axis) { return make(model::Coordinate{axis}); }
inline Expr operator+(const Expr& a, const Expr& b) { return make(model::Binary{BinaryOp::add, a, b}); }
inline Expr operator-(const Expr& a, const Expr& b) { return make(model::Binary{BinaryOp::subtract, a, b}); }
inline Expr operator*(const Expr& a, const Expr& b) { return make(model::Binary{BinaryOp::multiply, a, b}); }
inline Expr operator/(const Expr& a, const Expr& b) { return make(model::Binary{BinaryOp::divide, a, b}); }
inline Expr operator^(const Expr& a, const Expr& b) { return make(model::Binary{BinaryOp::power, a, b}); }
inline Expr operator-(const Expr& a) { return make(model::Neg{a}); }
inline Expr call(Fn fn, const Expr& a) { return make(model::Call{fn, {a}}); }
inline Expr d(const Expr& e, int axis = 0, int order = 1) { return make(model::Derivative{e, axis, order}); }
inline Expr lap(const Expr& e, int rank = 1) {
  Expr sum = d(e, 0, 2);
  for (int axis = 1; axis < rank; ++axis) sum = sum + d(e, axis, 2);
  return sum;
}
inline Expr advect(std::vector<Expr> velocity, const Expr& e) { return make(model::Advect{std::move(velocity), e}); }
inline Expr mean(const Expr& e) { return make(model::Reduce{model::Reduce::Kind::mean, e}); }
inline Expr sum(const Expr& e) { return make(model::Reduce{model::Reduce::Kind::sum, e}); }
inline Expr integral(const Expr& e) { return make(model::Reduce{model::Reduce::Kind::integral, e}); }

inline model::State state(const std::string& name, const Expr& rate) {
  model::State result;
  result.name = name;
  result.rhs = rate;
  return result;
}

/// A scene `s` on [0, length] along each axis.
inline model::Problem problem(std::vector<model::State> states, std::vector<int> cells = {8}, double length = 1,
                              Topology topology = Topology::periodic) {
  model::Problem result;
  result.scene = "s";
  result.model = "m";
  for (std::size_t a = 0; a < cells.size(); ++a) {
    result.axes.push_back({std::string(1, "xyz"[a]), 0, length, cells[a], topology});
  }
  for (model::State& s : states) {
    if (s.boundary.empty()) s.boundary.resize(cells.size());
  }
  result.states = std::move(states);
  result.steps = 10;
  result.step = 0.1;
  result.scheme.time = model::time_method("euler");
  return result;
}

}  // namespace model_builder
