// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/linear_form.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace dpde::stability {

using stencil::Offset;

namespace {

constexpr std::int64_t span = 2 * farthest_offset + 1;

}  // namespace

std::int64_t LinearForm::key_of(const Offset& offset) {
  return ((offset[2] * span + offset[1]) * span + offset[0]) * most_components;
}

int LinearForm::component_of(std::int64_t key) {
  const auto rest = static_cast<int>(key % most_components);
  return rest < 0 ? rest + most_components : rest;
}

Offset LinearForm::offset_of(std::int64_t key) {
  std::int64_t rest = (key - component_of(key)) / most_components;
  Offset offset{};
  for (int axis = 0; axis < 2; ++axis) {
    std::int64_t part = rest % span;
    if (part > farthest_offset) part -= span;
    if (part < -farthest_offset) part += span;
    offset[static_cast<std::size_t>(axis)] = static_cast<int>(part);
    rest = (rest - part) / span;
  }
  offset[2] = static_cast<int>(rest);
  return offset;
}

LinearForm LinearForm::shifted(const Offset& offset) const {
  LinearForm result = *this;
  const std::int64_t way = key_of(offset);
  for (Term& term : result.terms_) term.key += way;
  return result;
}

bool LinearForm::is_finite() const {
  return std::ranges::all_of(terms_, [](const Term& term) { return std::isfinite(term.coefficient); });
}

LinearForm LinearForm::times(double factor) const {
  if (factor == 0) return {};
  LinearForm result = *this;
  for (Term& term : result.terms_) term.coefficient *= factor;
  return result;
}

LinearForm LinearForm::plus(const LinearForm& other) const {
  if (is_zero()) return other;
  if (other.is_zero()) return *this;
  LinearForm result;
  result.terms_.reserve(terms_.size() + other.terms_.size());
  auto a = terms_.begin(), b = other.terms_.begin();
  while (a != terms_.end() || b != other.terms_.end()) {
    if (b == other.terms_.end() || (a != terms_.end() && a->key < b->key)) {
      result.terms_.push_back(*a++);
    } else if (a == terms_.end() || b->key < a->key) {
      result.terms_.push_back(*b++);
    } else {
      result.terms_.push_back({a->key, a->coefficient + b->coefficient});
      ++a, ++b;
    }
  }
  return result;
}

LinearForm LinearForm::renumbered(int by) const {
  LinearForm result;
  for (const Term& term : terms_) {
    const bool is_wave = component_of(term.key) >= most_states;
    result.terms_.push_back({term.key + (is_wave ? by : 0), term.coefficient});
  }
  std::ranges::sort(result.terms_, {}, &Term::key);
  return result;
}

/// The slot of the key, or the free slot for it, by linear probing.
std::size_t FormSum::place_of(std::int64_t key) const {
  constexpr std::uint64_t golden = 0x9E3779B97F4A7C15;  // 2^64 times the golden ratio: it spreads keys that are near
  const std::size_t last = places_.size() - 1;
  std::size_t place = static_cast<std::size_t>((static_cast<std::uint64_t>(key) * golden) >> 32) & last;
  while (places_[place] != 0 && terms_[places_[place] - 1].key != key) place = (place + 1) & last;
  return place;
}

/// Grows the table to a power of two of at least four times its entries.
void FormSum::grow() {
  constexpr std::size_t fewest = 256;
  places_.assign(std::max(fewest, 4 * std::bit_ceil(terms_.size())), 0);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    taken_[i] = place_of(terms_[i].key);
    places_[taken_[i]] = static_cast<std::uint32_t>(i + 1);
  }
}

void FormSum::add(const LinearForm& form, const stencil::Offset& offset, double factor) {
  const std::int64_t way = LinearForm::key_of(offset);
  for (const LinearForm::Term& term : form.terms_) {
    if (2 * terms_.size() >= places_.size()) grow();
    const std::size_t place = place_of(term.key + way);
    std::uint32_t& known = places_[place];
    if (known == 0) {
      terms_.push_back({term.key + way, factor * term.coefficient});
      taken_.push_back(place);
      known = static_cast<std::uint32_t>(terms_.size());
    } else {
      terms_[known - 1].coefficient += factor * term.coefficient;
    }
  }
}

LinearForm FormSum::take() {
  for (const std::size_t place : taken_) places_[place] = 0;
  LinearForm result;
  result.terms_.assign(terms_.begin(), terms_.end());
  std::ranges::sort(result.terms_, {}, &LinearForm::Term::key);
  terms_.clear();
  taken_.clear();
  return result;
}

}  // namespace dpde::stability
