// SPDX-License-Identifier: Apache-2.0
// Derivatives by Fourier series: fields of their own, made by transforms before the kernel.
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/discretise.h"
#include "stencil/symbol.h"

namespace dpde::stencil {

WaveReading Discretiser::wave_reading() {
  return waves_of(scheme_, [this](const model::Expr& uniform) { return at(uniform, {}).value(); });
}

/// The transform that makes `e`, of operands at the cells; read at another cell it is displaced.
Discretiser::Quotient Discretiser::waves_at(const model::Expr& e, const Place& place) {
  const WaveReading reading = wave_reading();
  std::vector<WavePart> parts;
  if (const model::Derivative* d = std::get_if<model::Derivative>(&e->kind); d && !reading.is_multiplier(e)) {
    parts = {{d->operand, wave_number(d->axis)}};  // the slope in an advect: what dx is does not matter
  } else {
    parts = wave_parts(e, reading);
  }
  Transform transform;
  for (const WavePart& part : parts)
    transform.terms.push_back({stored_operand(part.operand, {}), {{}, 0.0, part.symbol, false}});
  return Quotient{access(stored_transform(std::move(transform)), Offset{place[0] / 2, place[1] / 2, place[2] / 2})};
}

/// Terms of a sum that are made of waves are one transform, where there are several.
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
  if (model::is_constant(rest, 0)) return of_waves;
  return Quotient{at(rest, place).value() + of_waves.value()};
}

/// The field that holds the result.
std::string Discretiser::stored_transform(Transform transform) {
  for (const Preparation& made : preparations_) {
    const Transform* known = std::get_if<Transform>(&made);
    if (known && known->terms == transform.terms) return known->result;
  }
  transform.result = names_.fresh(transform.terms.front().field + "_waves");
  preparations_.push_back(transform);
  return transform.result;
}

}  // namespace dpde::stencil
