// SPDX-License-Identifier: Apache-2.0
// std::variant for dozens of kinds. Instantiations of std::variant grow with the square of the number of kinds (GCC 12:
// a third of the compilation time of a parser with 54 kinds); here they grow linearly.
#pragma once

#include <algorithm>
#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

#include "support/assert.h"

namespace dpde {

/// Holds one of `Kinds`. Never valueless, since no kind throws when moved.
template <class... Kinds>
class Variant {
 public:
  template <class Kind>
  requires(std::is_same_v<Kind, Kinds> || ...) Variant(Kind kind) : index_(index_of<Kind>()) {
    static_assert((std::is_nothrow_move_constructible_v<Kinds> && ...));
    ::new (memory_) Kind(std::move(kind));
  }
  Variant(const Variant& other) : index_(other.index_) {
    (void)(other.on<Kinds>([&](const Kinds& kind) { ::new (memory_) Kinds(kind); }) || ...);
  }
  Variant(Variant&& other) noexcept : index_(other.index_) {
    (void)(other.on<Kinds>([&](Kinds& kind) { ::new (memory_) Kinds(std::move(kind)); }) || ...);
  }
  Variant& operator=(const Variant& other) { return *this = Variant(other); }
  Variant& operator=(Variant&& other) noexcept {
    if (this == &other) return *this;
    this->~Variant();
    return *::new (this) Variant(std::move(other));
  }
  ~Variant() {
    (void)(on<Kinds>([](Kinds& kind) { kind.~Kinds(); }) || ...);
  }

  template <class Kind>
  friend const Kind* get_if(const Variant* v) {
    return v->index_ == index_of<Kind>() ? std::launder(reinterpret_cast<const Kind*>(v->memory_)) : nullptr;
  }
  template <class Kind>
  friend Kind* get_if(Variant* v) {
    return v->index_ == index_of<Kind>() ? std::launder(reinterpret_cast<Kind*>(v->memory_)) : nullptr;
  }
  template <class Kind>
  friend bool holds(const Variant& v) {
    return v.index_ == index_of<Kind>();
  }
  /// Requires that it holds this kind.
  template <class Kind>
  friend const Kind& get(const Variant& v) {
    require(holds<Kind>(v), "a kind that it holds");
    return *get_if<Kind>(&v);
  }

 private:
  template <class Kind>
  static constexpr int index_of() {
    int index = 0;
    (void)((std::is_same_v<Kind, Kinds> || (++index, false)) || ...);
    return index;
  }
  template <class Kind, class F>
  bool on(const F& f) const {
    const Kind* kind = get_if<Kind>(this);
    if (kind) f(*kind);
    return kind;
  }
  template <class Kind, class F>
  bool on(const F& f) {
    Kind* kind = get_if<Kind>(this);
    if (kind) f(*kind);
    return kind;
  }

  alignas(Kinds...) std::byte memory_[std::max({sizeof(Kinds)...})];
  int index_;
};

}  // namespace dpde
