// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/waves.h"

#include <algorithm>
#include <utility>

#include "model/build.h"
#include "stencil/analyse/symbol.h"
#include "stencil/build.h"

namespace dpde::stencil {

namespace {

bool is_sum(const model::Binary& b) { return b.op == BinaryOp::add || b.op == BinaryOp::subtract; }

class WaveParts {
 public:
  explicit WaveParts(const WaveReading& reading) : reading_(reading) {}

  void add(const model::Expr& e, const Expr& symbol) {
    if (const model::Neg* neg = as<model::Neg>(e)) return add(neg->operand, -symbol);
    if (const model::Binary* b = as<model::Binary>(e); b && add_binary(*b, symbol)) return;
    if (const model::Derivative* d = as<model::Derivative>(e); d && reading_.is_multiplier(e)) {
      return add(d->operand, symbol * multiplier_of(*d));
    }
    if (const model::Advect* a = as<model::Advect>(e); a && is_of_waves(e, reading_)) {
      for (std::size_t axis = 0; axis < a->velocity.size(); ++axis)
        add(a->operand, symbol * reading_.value(a->velocity[axis]) * wave_number(static_cast<int>(axis)));
      return;
    }
    const auto known = std::ranges::find(all, e, &WavePart::operand);
    if (known == all.end()) {
      all.push_back({e, symbol});
    } else {
      known->symbol = known->symbol + symbol;
    }
  }

  std::vector<WavePart> all;

 private:
  Expr multiplier_of(const model::Derivative& d) const {
    const Expr waves = wave_number(d.axis);
    if (d.order % 2 == 0 || !reading_.one_by_one) return d.order == 1 ? waves : power(waves, d.order);
    const Expr slope = slope_number(d.axis);
    return d.order == 1 ? slope : slope * power(waves, d.order - 1);
  }

  bool add_binary(const model::Binary& b, const Expr& symbol) {
    if (is_sum(b)) {
      add(b.left, symbol);
      add(b.right, b.op == BinaryOp::add ? symbol : -symbol);
      return true;
    }
    const bool divides = b.op == BinaryOp::divide;
    if (!divides && b.op != BinaryOp::multiply) return false;
    if (model::is_uniform(b.right)) {
      const Expr factor = reading_.value(b.right);
      add(b.left, divides ? symbol / factor : symbol * factor);
      return true;
    }
    if (divides || !model::is_uniform(b.left)) return false;
    add(b.right, symbol * reading_.value(b.left));
    return true;
  }

  const WaveReading& reading_;
};

}  // namespace

WaveReading waves_of(const model::Scheme& scheme, std::function<Expr(const model::Expr& uniform)> value) {
  return {[scheme](const model::Expr& e) { return model::is_spectral(scheme, e); }, std::move(value)};
}

bool is_of_waves(const model::Expr& e, const WaveReading& reading) {
  if (const model::Neg* neg = as<model::Neg>(e)) return is_of_waves(neg->operand, reading);
  if (as<model::Derivative>(e)) return reading.is_multiplier(e);
  if (const model::Advect* a = as<model::Advect>(e))
    return reading.is_multiplier(e) && std::ranges::all_of(a->velocity, model::is_uniform);
  const model::Binary* b = as<model::Binary>(e);
  if (!b) return false;
  if (is_sum(*b)) return is_of_waves(b->left, reading) && is_of_waves(b->right, reading);
  if (b->op == BinaryOp::multiply && model::is_uniform(b->left)) return is_of_waves(b->right, reading);
  const bool scales = b->op == BinaryOp::multiply || b->op == BinaryOp::divide;
  return scales && model::is_uniform(b->right) && is_of_waves(b->left, reading);
}

std::vector<WavePart> wave_parts(const model::Expr& e, const WaveReading& reading) {
  WaveParts parts(reading);
  parts.add(e, 1.0);
  for (WavePart& part : parts.all) {
    if (const auto polynomial = polynomial_of(part.symbol)) part.symbol = expression_of(*polynomial);
  }
  return std::move(parts.all);
}

}  // namespace dpde::stencil
