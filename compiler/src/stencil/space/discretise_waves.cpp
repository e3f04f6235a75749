// SPDX-License-Identifier: Apache-2.0
// Derivatives by Fourier series: fields that transforms compute before the kernel.
#include "model/analyse/solves.h"
#include "model/build.h"
#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "stencil/space/discretise.h"

namespace dpde::stencil {

WaveReading Discretiser::wave_reading() {
  return waves_of(scheme_, [this](const model::Expr& uniform) { return at(uniform, {}).value(); });
}

/// The result of the transform that computes `e` from operands at the cells; at another cell it is read at an offset.
Discretiser::Quotient Discretiser::waves_at(const model::Expr& e, const Place& place) {
  const WaveReading reading = wave_reading();
  std::vector<WavePart> parts;
  if (const model::Derivative* d = as<model::Derivative>(e); d && !reading.is_multiplier(e)) {
    parts = {{d->operand, wave_number(d->axis)}};  // the derivative in an advect: independent of the rule for dx
  } else {
    parts = wave_parts(e, reading);
  }
  return Quotient{access(stored_waves(parts), Offset{place[0] / 2, place[1] / 2, place[2] / 2})};
}

/// The field with the sum of the parts. An operand that solves an equation wave by wave is replaced by its right side
/// divided by the operator: so the velocities of a stream function are computed from the vorticity.
std::string Discretiser::stored_waves(const std::vector<WavePart>& parts) {
  Transform transform;
  for (const WavePart& part : parts) {
    const model::Solve* solve = as<model::Solve>(part.operand);
    if (solve == nullptr || !model::is_of_waves(*solve, scheme_)) {
      transform.terms.push_back({stored_operand(part.operand, {}), {{}, 0.0, part.symbol, false}});
      continue;
    }
    WaveReading of_operation = wave_reading();
    of_operation.one_by_one = true;
    const std::vector<WavePart> operation = wave_parts(solve->operation, of_operation);
    require(operation.size() == 1, "the operator holds the unknown alone");
    std::vector<WavePart> rights = wave_parts(solve->right, wave_reading());
    // For a wave of two cells the mean of a product is not the product of the means: derivatives are not combined.
    const auto has_waves = [](const WavePart& right) { return holds_wave_number(right.symbol); };
    if (std::ranges::any_of(rights, has_waves)) rights = {{solve->right, 1.0}};
    for (const WavePart& right : rights) {
      const Multiplier by{
          {WaveFunction::Kind::inverse, 1}, operation.front().symbol, right.symbol * part.symbol, false};
      transform.terms.push_back({stored_operand(right.operand, {}), by});
    }
  }
  return stored_transform(std::move(transform));
}

/// All waves below the upper end minus those below the lower end; -|k|^2 is the sum of the squares of i k. The result
/// has the placement and the displacement of the operand.
Expr Discretiser::band_at(const model::BandPass& band, const Place& place) {
  Place own{};
  Offset displaced{};
  for (std::size_t axis = 0; axis < place.size(); ++axis) {
    own[axis] = std::abs(place[axis] % 2);
    displaced[axis] = (place[axis] - own[axis]) / 2;
  }
  Expr squares = 0.0;
  for (int axis = 0; axis < static_cast<int>(rank_); ++axis) squares = squares + power(wave_number(axis), 2);
  const std::string operand = stored_operand(band.operand, own);
  Transform transform;
  const auto add_below = [&](double shell, double factor) {
    const double end = shell * band.unit;
    transform.terms.push_back(
        {operand,
         {{WaveFunction::Kind::heaviside, 0}, squares + end * end * (1 - model::shell_rounding), factor, false}});
  };
  add_below(band.last + 0.5, 1);
  if (band.first > 0) add_below(band.first - 0.5, -1);
  return access(stored_transform(std::move(transform)), displaced);
}

/// Combines several Fourier terms of a sum into one transform.
std::optional<Discretiser::Quotient> Discretiser::sum_of_waves(const model::Binary& e, const Place& place) {
  if (e.op != BinaryOp::add && e.op != BinaryOp::subtract) return std::nullopt;
  const WaveReading reading = wave_reading();
  model::Expr waves = 0.0, rest = 0.0;
  int count = 0;
  for (const model::Term& term : model::terms_of(model::Expr(model::Node{e}))) {
    const bool is_wave = is_of_waves(term.value, reading);
    model::Expr& sum = is_wave ? waves : rest;
    sum = model::binary(term.negative ? BinaryOp::subtract : BinaryOp::add, sum, term.value);
    count += is_wave;
  }
  if (count < 2) return std::nullopt;
  const Quotient of_waves = waves_at(waves, place);
  if (is_literal(rest, 0)) return of_waves;
  return Quotient{at(rest, place).value() + of_waves.value()};
}

/// The field with the result of the transform.
std::string Discretiser::stored_transform(Transform transform) {
  for (const Prerequisite& made : preparations_) {
    const Transform* known = std::get_if<Transform>(&made);
    if (known && known->terms == transform.terms) return known->result;
  }
  transform.result = names_.fresh(transform.terms.front().field + "_waves");
  preparations_.push_back(transform);
  return transform.result;
}

}  // namespace dpde::stencil
